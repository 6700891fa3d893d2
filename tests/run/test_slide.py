"""Whole runs in which nodes slide, on meshes of all sorts: every promise of docs/sliding.md, in exact arithmetic.

GMSNET_GUARD_EXAMPLES: how many meshes.
"""

from __future__ import annotations

import os
from contextlib import suppress
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import quads as naive
from support.naive_curves import naive_chains, patchwork, sagittas

import gmsnet
from gmsnet import METHODS, CellBlock, Mesh
from gmsnet.constraints.features import curves_of
from gmsnet.generate import disturb, random_mesh, random_quad_mesh
from gmsnet.kernels.star.guard import LEVELS, STAR, VALID

EXAMPLES = int(os.environ.get("GMSNET_GUARD_EXAMPLES", "40"))
OBLIQUE = [[0.1, 0.2], [1.3, -0.1], [1.0, 0.9], [-0.2, 1.1]]
WAVED = [[x, 0.1 * np.sin(6.0 * x)] for x in np.linspace(0.0, 1.0, 12)] + [[1.0, 1.0], [0.0, 1.0]]
SHAPES = ("square", "circle", "plate", "lshape", [OBLIQUE], [WAVED])
SLIDING = [name for name, method in METHODS.items() if method.slides]


def some_mesh(seed: int) -> Mesh:
    """Triangles, quads or both; perhaps regions, marked lines inside, inverted cells, single precision, patchwork."""
    rng = np.random.default_rng(seed)
    if rng.random() < 0.3:
        return patchwork(seed, even=bool(rng.random() < 0.2))
    shape, spacing = SHAPES[rng.integers(len(SHAPES))], str(rng.choice(["even", "random"]))
    nodes, cells = int(rng.integers(3, 60)), str(rng.choice(["triangle", "quad", "mixed"]))
    mesh = random_mesh(nodes, shape, boundary=spacing, seed=seed)
    if cells != "triangle":
        with suppress(gmsnet.InputError):  # a cell that is too flat to be split
            mesh = random_quad_mesh(nodes, shape, cells=cells, boundary=spacing, seed=seed)
    if rng.random() < 0.3:
        mesh = disturb(mesh, rng.random(len(mesh.points)) < 0.2, 0.5, seed=seed, keep_valid=bool(rng.random() < 0.5))
    points, blocks, names = mesh.points, list(mesh.cells), dict(mesh.region_names)
    if rng.random() < 0.5:  # regions on both sides of a line or a circle
        way, at = rng.standard_normal(2), rng.random(2)
        for k, block in enumerate(blocks):
            if block.dimension == 2:
                off = points[block.nodes].mean(axis=1) - at
                one = off @ way > 0.0 if rng.random() < 0.5 else (off**2).sum(axis=1) < 0.1
                blocks[k] = CellBlock(block.kind, block.nodes, np.where(one, 7, block.regions))
    if rng.random() < 0.4:  # lines inside
        faces = np.concatenate([block.nodes[:, :2] for block in blocks if block.dimension == 2])
        lines = faces[rng.integers(len(faces), size=rng.integers(1, 20))]
        blocks.append(CellBlock("line", lines, np.full(len(lines), 90)))
        names[1, 90] = "inside"
    single = bool(rng.random() < 0.25)
    points = points * 10.0 ** int(rng.choice([0, 0, -7, 5])) + rng.choice([0.0, 0.0, 3.7, -1e4])
    points = np.float64(np.float32(points)) if single else points
    if rng.random() < 0.1:
        points = np.insert(points, int(rng.integers(3)), 0.5, axis=1)
    return Mesh(points, tuple(blocks), names, single=single)


def some_options(mesh: Mesh, seed: int) -> dict:
    rng = np.random.default_rng(seed + 1)
    names = list(mesh.markers)
    named = bool(names) and rng.random() < 0.3
    chosen = [str(name) for name in rng.choice(names, size=rng.integers(1, len(names) + 1))] if named else None
    options = {
        "method": str(rng.choice(["auto", "auto", *SLIDING])),
        "guard": str(rng.choice(["worst", "worst", *LEVELS])),
        "slide": True if chosen is None else chosen,
        "feature_angle": float(rng.choice([5.0, 30.0, 30.0, 60.0, 120.0])),
        "fixed": rng.random(len(mesh.points)) < rng.choice([0.0, 0.1]),
        "preserve": str(rng.choice(["shape", "none"])),
        "untangle": bool(rng.random() < 0.8),
        "max_sweeps": int(rng.integers(0, 40)),
        "threads": int(rng.integers(1, 3)),
    }
    if rng.random() < 0.25:  # towards a metric
        options |= {"method": "auto", "guard": str(rng.choice(LEVELS[:2])), "preserve": "metric"}
        if rng.random() < 0.5:
            across = np.array(naive.plane(mesh))[:, 0]
            low, extent = across.min(), float(np.ptp(across)) or 1.0

            def size(at):
                return 0.1 * extent * 4.0 ** np.clip((at[:, 0] - low) / extent, 0.0, 1.0)

            options |= {"preserve": "shape", "size": size}
    return options


def worst_corner(at, cell) -> Fraction:
    """(1/q)² of a cell with the sign of 1/q, exactly; 0 where its edges have no length."""

    def squared(a, b):
        return sum((Fraction(p) - Fraction(q)) ** 2 for p, q in zip(at[a], at[b], strict=True))

    if len(cell) == 3:
        area, lengths, factor = naive.doubled_area(at, cell), sum(squared(a, b) for a, b in naive.sides(cell)), 12
        return factor * area * abs(area) / lengths**2 if lengths else Fraction(0)
    values = []
    for corner, after, before in naive.corners(cell):
        area, lengths = naive.determinant(at, corner, after, before), squared(corner, after) + squared(corner, before)
        values.append(4 * area * abs(area) / lengths**2 if lengths else Fraction(0))
    return min(values)


def may_slide(mesh: Mesh, options: dict) -> set[int]:
    """The inner nodes of chains that were not fixed and, where names are given, belong to their markers."""
    chains = naive_chains(Mesh(np.array(naive.plane(mesh)), mesh.cells), options["feature_angle"])
    at: dict[int, int] = {}
    for closed, edges in chains:
        own: dict[int, int] = {}
        for edge in edges:
            for node in edge:
                own[node] = own.get(node, 0) + 1
        for node, count in own.items():  # an end belongs to several chains, or to one once
            at[node] = at.get(node, 0) + (1 if count == 2 or closed else 9)
    inner = {node for node, count in at.items() if count == 1}
    if options["slide"] is not True:
        inner &= {int(node) for name in options["slide"] for node in mesh.markers[name]}
    return inner - set(np.flatnonzero(options["fixed"]).tolist())


def rounding(mesh: Mesh) -> float:
    return (2.0**-23 if mesh.single else 2.0**-51) * float(np.abs(np.array(naive.plane(mesh))).max())


def check_line(mesh: Mesh, before, after, nodes) -> None:
    """Slid nodes of a straight curve: on the line through its ends to rounding, or with the bits of a coordinate."""
    same = (before[nodes] == before[nodes[0]]).all(axis=0)
    assert (after[nodes][:, same] == before[nodes[0], same]).all()
    if same.any():
        return
    (ax, ay), (bx, by) = ([Fraction(v) for v in before[node].tolist()] for node in nodes[[0, -1]])
    length = np.hypot(float(bx - ax), float(by - ay))
    for node in nodes[(after[nodes] != before[nodes]).any(axis=1)]:
        x, y = map(Fraction, after[node].tolist())
        assert float(abs((bx - ax) * (y - ay) - (by - ay) * (x - ax))) <= rounding(mesh) * length


def places(mesh: Mesh, p, allowed, x) -> list[float]:
    """Where along a polyline (edge number plus share) the feet of x are on edges that it is near enough to."""
    edge = np.diff(p, axis=0)
    share = ((x - p[:-1]) * edge).sum(axis=1) / (edge * edge).sum(axis=1)
    slack = rounding(mesh) / np.sqrt((edge * edge).sum(axis=1)) + 1e-9
    inside = np.clip(share, 0.0, 1.0)
    away = np.hypot(*(x - p[:-1] - inside[:, None] * edge).T)
    near = (away <= allowed * (1.0 + 1e-9) + rounding(mesh)) & (share > -slack) & (share < 1.0 + slack)
    return sorted((np.flatnonzero(near) + inside[near]).tolist())


def follow_each_other(found: list[list[float]], count: int, closed: bool, slack: float) -> bool:
    """Whether one place can be taken of each node so that they ascend, once around where the curve is closed."""
    for first in found[0]:
        at, rest = first, found[1:]
        for candidates in rest:
            around = [u + (count if closed and u < first - slack else 0.0) for u in candidates]
            later = sorted(u for u in around if u > at - slack)
            if not later:
                break
            at = later[0]
        else:
            if not closed or at < first + count + slack:
                return True
    return False


def check_curve(mesh: Mesh, before, after, nodes, closed: bool) -> None:
    """No node is further from the input's polyline than its sagitta there, and all are in their order along it."""
    p = before[nodes]
    allowed = sagittas(p, closed)
    where = [places(mesh, p, allowed, after[node]) for node in (nodes[:-1] if closed else nodes)]
    assert all(where), "further from the polyline than its sagitta"
    if not closed:
        where[0], where[-1] = [0.0], [len(p) - 1.0]
    shortest = float(np.hypot(*np.diff(p, axis=0).T).min())
    assert follow_each_other(where, len(p) - 1, closed, rounding(mesh) / shortest + 1e-9)


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=EXAMPLES, deadline=None)
def test_every_promise_is_kept(seed):
    mesh = some_mesh(seed)
    options = some_options(mesh, seed)
    given_points = mesh.points.tobytes()
    result = gmsnet.smooth(mesh, **options)
    assert mesh.points.tobytes() == given_points
    for old, new in zip(mesh.cells, result.mesh.cells, strict=True):
        assert old is new
    assert result.mesh.region_names == mesh.region_names
    assert {k: v.tolist() for k, v in result.mesh.markers.items()} == {k: v.tolist() for k, v in mesh.markers.items()}
    assert np.isfinite(result.points).all()
    if mesh.single:
        moved = result.points[result.moved]
        assert (np.float64(np.float32(moved)) == moved).all()

    held = naive.held(mesh) - may_slide(mesh, options) | set(np.flatnonzero(options["fixed"]).tolist())
    still = sorted(held)
    assert result.points[still].tobytes() == mesh.points[still].tobytes()

    cells = naive.wound(mesh)
    was, now = naive.plane(mesh), naive.plane(mesh.with_points(result.points))
    changed = [cell for cell in cells if any(result.moved[list(cell)])]
    valid = [naive.valid(was, cell) for cell in changed]
    assert all(naive.valid(now, cell) for cell, sound in zip(changed, valid, strict=True) if sound)
    level = LEVELS.index(options["guard"])
    in_metric = options["preserve"] == "metric" or "size" in options
    if changed and level != VALID and not in_metric:
        before, after = ([worst_corner(at, cell) for cell in cells] for at in (was, now))
        assert min(after) >= min(before)
        if level == STAR and not result.before.inverted:
            around: dict[int, list[int]] = {}
            for number, cell in enumerate(cells):
                for node in cell:
                    around.setdefault(node, []).append(number)
            for node in result.topology.free.tolist():
                assert min(after[k] for k in around[node]) >= min(before[k] for k in around[node])

    curves = curves_of(mesh, options["slide"], options["feature_angle"], options["fixed"])
    before, after = np.array(was), np.array(now)
    for c in range(len(curves)):
        nodes, closed = curves.nodes_of(c), bool(curves.closed[c])
        if not (before[nodes] != after[nodes]).any():
            continue
        if not closed:
            assert (before[nodes[[0, -1]]] == after[nodes[[0, -1]]]).all()
        if curves.straight[c]:
            check_line(mesh, before, after, nodes)
            along = (after[nodes] - after[nodes[0]]) @ (after[nodes[-1]] - after[nodes[0]])
            assert all(one < other for one, other in pairwise(along.tolist()))
        else:
            check_curve(mesh, before, after, nodes, closed)


@pytest.mark.parametrize("method", SLIDING)
def test_every_method_that_lets_nodes_slide_does(method):
    """So that the meshes above are no test of nothing."""
    for cells in ("triangle", "quad", "mixed"):
        if cells == "triangle":
            mesh = random_mesh(200, boundary="random", seed=3)
        else:
            mesh = random_quad_mesh(200, cells=cells, boundary="random", seed=3)
        result = gmsnet.smooth(mesh, method, slide=True, preserve="none")
        assert result.moved[mesh.markers["bottom"]].any()
        assert result.after.shape.min() >= result.before.shape.min()


@pytest.mark.parametrize("below", [0.0, 1e-6, 1e-3])
def test_the_area_that_is_told_does_not_depend_on_the_scale(below):
    """Coordinates are divided by a power of two, which changes if the largest one falls below another."""
    mesh = random_mesh(300, "circle", boundary="random", seed=1)
    points = mesh.points - 0.5
    scaled = mesh.with_points(points * (1.0 - below) / abs(points).max())
    result = gmsnet.smooth(scaled, slide=True)
    assert below or scaled.exponent != result.mesh.exponent
    note = next(note for note in result.notes if note.startswith("slide: "))
    assert float(note.split("more than ")[1].split()[0]) < 0.01

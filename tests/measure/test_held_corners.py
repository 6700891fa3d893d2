"""A corner of a quad or a volume cell whose spokes are held bounds the quality of its cell."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import blocks

import gmsnet
from gmsnet.cells.table import CELLS
from gmsnet.errors import InputError
from gmsnet.generate import random_quad_mesh, structured_mesh
from gmsnet.measure.bounds.bounds import limits
from gmsnet.measure.bounds.groups import HELD, HELD_CORNER
from gmsnet.measure.report import connectivity_of, measure
from gmsnet.mesh.mesh import Mesh
from gmsnet.run import stop

KINDS = {
    "hexahedra": {},
    "wedges": {"wedges": [(0, 0), (1, 2), (2, 2)]},
    "pyramids": {"pyramids": [(1, 1, 1), (2, 1, 1)]},
}
ROUNDING = 2e-6


def with_sharp_corner(place=0.2, **more):
    """A block of 3 x 3 x 3 whose first corner is sharp: the node beside it on the first edge is near, all is held."""
    mesh = blocks.block(3, 3, 3, jitter=0.25, seed=1, **more)
    points = mesh.points.copy()
    points[np.flatnonzero((points == (1, 0, 0)).all(axis=1))] = (place, 0, 0)
    return Mesh(points, mesh.cells)


def slow_bounds(mesh, topology, report):
    """Number of a cell → what its held corners, or all of it, allow; from the cell's own nodes, one by one."""
    free, found, before = set(topology.free.tolist()), {}, 0
    for block in mesh.cells:
        kind = CELLS[block.kind]
        for at, nodes in enumerate(block.nodes.tolist()):
            row = np.flatnonzero(report.cell == before + at)
            if not len(row):
                continue
            if not free & set(nodes):
                found[before + at] = report.shape[row[0]]
                continue
            values, dimension = [], kind.dimension
            for simplex, inverse in zip(kind.simplices, kind.ideal, strict=True):
                if free & {nodes[k] for k in simplex} or len(kind.simplices) in (3, 1):
                    continue
                root, *ends = mesh.points[[nodes[k] for k in simplex], :dimension]
                deviation = (np.array(ends) - root).T @ np.array(inverse)
                size = np.linalg.det(deviation)
                values.append(np.sign(size) * dimension * abs(size) ** (2 / dimension) / (deviation**2).sum())
            if values:
                found[before + at] = min(values)
        before += len(block.nodes)
    return found


@pytest.mark.parametrize("more", KINDS.values(), ids=KINDS)
@pytest.mark.parametrize("below", [0.9, 0.5])
def test_bounds_of_volumes_are_those_of_a_slow_twin(more, below):
    mesh = with_sharp_corner(**more)
    topology, report = connectivity_of(mesh), measure(mesh)
    slow = {cell: bound for cell, bound in slow_bounds(mesh, topology, report).items() if bound + ROUNDING < below}
    found = limits(mesh, topology, below)
    assert set(found.kind.tolist()) <= {HELD, HELD_CORNER}
    assert sorted(found.cell[found.rows].tolist()) == sorted(slow)
    for cell, bound in zip(found.cell[found.rows].tolist(), found.bound.tolist(), strict=True):
        assert bound == pytest.approx(slow[cell], abs=ROUNDING)


@pytest.mark.parametrize(
    "mesh", [structured_mesh(7), random_quad_mesh(80, cells="mixed", seed=2)], ids=["quads", "mixed"]
)
def test_bounds_of_planar_quads_are_those_of_a_slow_twin(mesh):
    rng = np.random.default_rng(3)
    points = mesh.points + 0.0
    edges = ~np.isin(np.arange(len(points)), connectivity_of(mesh).free)
    points[edges, 0] += 0.04 * rng.uniform(-1, 1, np.count_nonzero(edges))
    mesh = Mesh(points, mesh.cells)
    topology, report = connectivity_of(mesh), measure(mesh)
    slow = {cell: bound for cell, bound in slow_bounds(mesh, topology, report).items() if bound + ROUNDING < 1.0}
    found = limits(mesh, topology, 1.0)
    ours = {
        int(found.cell[found.cells(g)[0]]): found.bound[g]
        for g in range(len(found.bound))
        if found.kind[g] in (HELD, HELD_CORNER)
    }
    assert len(ours)
    assert sorted(ours) == sorted(slow)
    assert all(ours[cell] == pytest.approx(slow[cell], abs=ROUNDING) for cell in slow)


@given(st.integers(0, 1000), st.sampled_from(sorted(KINDS)))
@settings(max_examples=20)
def test_no_result_is_better_than_its_bounds(seed, name):
    mesh = with_sharp_corner(0.2 + 0.4 * (seed % 7) / 7, **KINDS[name])
    found = gmsnet.smooth(mesh)
    limit = found.limits
    assert len(limit.bound)
    for group in range(len(limit.bound)):
        assert found.after.shape[limit.cells(group)].min() <= limit.bound[group] + ROUNDING


@pytest.mark.parametrize("more", KINDS.values(), ids=KINDS)
def test_a_target_that_a_held_corner_misses_is_not_called_reached(more):
    mesh = with_sharp_corner(**more)
    for target in (0.35, 0.6, 0.9):
        result = gmsnet.smooth(mesh, target_quality=target)
        assert result.after.shape.min() < target
        assert result.stop_reason in (stop.NO_PROGRESS, stop.NOTHING_TO_MOVE)
        assert "is held with its neighbours" in result.limits.describe(0)
        assert result.limits.ceiling == pytest.approx(result.after.shape.min(), abs=ROUNDING)
        row = int(result.after.shape.argmin())
        (reason,) = result.limits.reasons(np.array([row]), target).values()
        assert reason.startswith("its corner at node ")


def test_a_quad_whose_held_corner_misses_a_target_is_not_called_reached():
    mesh = structured_mesh(6)
    points = mesh.points + 0.0
    points[np.flatnonzero((points == (points[:, 0].max(), 0)).all(axis=1)), 0] += 2.0
    mesh = Mesh(points, mesh.cells)
    result = gmsnet.smooth(mesh, target_quality=0.9)
    assert result.stop_reason in (stop.NO_PROGRESS, stop.NOTHING_TO_MOVE)
    assert result.after.shape.min() <= result.limits.ceiling < 0.9


@pytest.mark.parametrize("more", [{}, {"method": "laplacian"}, {"slide": "all"}], ids=str)
def test_cells_that_all_name_a_node_twice_have_no_bound_and_are_told(more):
    mesh = Mesh(np.eye(6, 3), [blocks.cells_of("hexahedron", [[0, 1, 2, 2, 3, 4, 5, 5]])])
    found = gmsnet.smooth(mesh, **more)
    assert found.limits.ceiling == 1.0
    assert not len(found.limits.bound)
    assert found.stop_reason == stop.NOTHING_TO_MOVE
    assert "not measured, and their nodes are held: 1 cell that names a node twice" in found.notes
    with pytest.raises(InputError, match="this mesh has none: 1 cell that names a node twice"):
        gmsnet.smooth(mesh, target_quality=0.3, **more)

"""What each level of the guard promises of surfaces in space, in exact arithmetic, after every sweep of every method.

GMSNET_GUARD_EXAMPLES: how many meshes for each method and level.
"""

from __future__ import annotations

import os
from dataclasses import replace
from fractions import Fraction
from functools import partial

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from support.choices import CHOICES, name_of
from support.exact import whole
from support.surface_meshes import ball, box, surface_mesh, wavy
from support.surfaces import turned

import gmsnet
from gmsnet import METHODS
from gmsnet.kernels.star.guard import LEVELS, STAR, VALID
from gmsnet.mesh.mesh import Mesh
from gmsnet.mesh.rounding import Rounding
from gmsnet.methods import Field
from gmsnet.parallel.threads import serial
from gmsnet.run.options import SmoothOptions
from gmsnet.run.set_up import first_state
from gmsnet.topology.shell import Shell

EXAMPLES = int(os.environ.get("GMSNET_GUARD_EXAMPLES", "12"))
SWEEPS = 2
SIXTY = Fraction(1, 4)  # the square of its cosine
ROUNDING = Fraction(1, 10**9)  # of float64, in angles that were larger before


def takes_surfaces(choice):
    return METHODS[choice["method"]].moves_surfaces(choice.get("objective") or choice.get("variant"))


ON_SURFACES = [choice for choice in CHOICES if takes_surfaces(choice)]


def some_mesh(seed, kind, thrown, noise, where, single, fin):
    """Small surfaces: closed, open, sharp, noisy, of several kinds of cells, with a fin, far from the origin."""
    rng = np.random.default_rng(seed)
    if kind == "ball":
        mesh = ball(int(rng.integers(20, 50)), seed % 1000, thrown)
    elif kind == "box":
        mesh = box(3, seed % 1000, thrown)[0]
    else:
        mesh = wavy(4, seed % 1000, thrown, kind)
    points = mesh.points @ turned(seed % 99).T * 10.0 ** rng.uniform(-1, 0, 3)
    points = points + noise * rng.uniform(-1, 1, points.shape) * np.ptp(points, axis=0) / 10.0
    cells = {block.kind: block.nodes.copy() for block in mesh.cells}
    for rows in cells.values():  # however they are wound
        some = rng.random(len(rows)) < 0.3
        rows[some] = rows[some][:, ::-1]
    if fin and "triangle" in cells:
        edge = cells["triangle"][0][:2]
        points = np.vstack([points, points[edge].mean(axis=0) + np.ptp(points, axis=0)])
        cells["triangle"] = np.vstack([cells["triangle"], [*edge, len(points) - 1]])
    points = points * where[1] + where[0]
    made = surface_mesh(np.float64(np.float32(points)) if single else points, cells, single)
    assume(made.plane is None)
    return made


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def dot(a, b):
    return sum(p * q for p, q in zip(a, b, strict=True))


def minus(a, b):
    return [p - q for p, q in zip(a, b, strict=True)]


def worth(points, simplices):
    """Of each cell: is it upright at all corners, the least signed square of 1/q of them, and of each corner that of
    the cosine of the angle to its side: Fractions."""
    numbers, _ = whole(points[:, :3].ravel().tolist())
    exact = [numbers[k : k + 3] for k in range(0, len(numbers), 3)]
    cells = simplices.cells if simplices.cells is not None else np.arange(len(simplices.rows))
    found = {}
    for cell in np.unique(cells):
        own = np.flatnonzero(cells == cell)
        upright, least, cosines = True, None, []
        for t in own:
            v, p, q = (exact[i] for i in simplices.rows[t].tolist())
            if simplices.orientation[t] < 0:
                p, q = q, p
            a, b = minus(p, v), minus(q, v)
            c = cross(a, b)
            side, common = whole(simplices.side[t].tolist())
            shows, length = Fraction(dot(c, side), common), dot(c, c)
            upright = upright and shows > 0
            cosines.append(shows * abs(shows) / length if length else Fraction(0))
            if len(own) == 1:
                edges = dot(a, a) + dot(b, b) + dot(minus(b, a), minus(b, a))
                value = Fraction(12 * dot(c, c), edges**2) if edges else Fraction(0)
            else:
                first, after, before = simplices.rows[own[0]].tolist()
                (opposite,) = set(simplices.rows[own].ravel().tolist()) - {first, after, before}
                d = cross(minus(exact[opposite], exact[first]), minus(exact[before], exact[after]))
                area, edges = dot(d, d), dot(a, a) + dot(b, b)
                square = dot(c, d) * abs(dot(c, d))
                value = Fraction(4 * square, area * edges**2) if area * edges else Fraction(0)
            least = value if least is None else min(least, value)
        found[int(cell)] = (upright, least, cosines)
    return found


def check(level, before, after, stars, written=False):
    """before, after: of ``worth``. stars: of each node that was free, its cells. written: are places of ``after``
    rounded anew?"""
    for cell, (upright, value, cosines) in before.items():
        assert after[cell][0] or not upright
        assert after[cell][1] > 0 or value <= 0
        for was, now in zip(cosines, after[cell][2], strict=True):
            assert now > SIXTY or was <= SIXTY + ROUNDING
            assert now > SIXTY or now >= was - ROUNDING or written
    if level == VALID:
        return
    groups = stars if level == STAR else [list(before)]
    for cells in groups:
        was = min((before[cell][1] if before[cell][0] else Fraction(0) for cell in cells), default=Fraction(0))
        now = min((after[cell][1] if after[cell][0] else Fraction(0) for cell in cells), default=Fraction(0))
        assert now >= was or (was <= 0 and now <= 0)


@pytest.mark.parametrize("level", range(3), ids=LEVELS)
@pytest.mark.parametrize("choice", ON_SURFACES, ids=list(map(name_of, ON_SURFACES)))
@settings(max_examples=EXAMPLES, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    kind=st.sampled_from(["ball", "box", "triangle", "quad", "mixed"]),
    thrown=st.sampled_from([0.0, 0.2, 0.4, 0.8]),
    noise=st.sampled_from([0.0, 0.0, 0.05, 0.5]),
    where=st.sampled_from([(0.0, 1.0), (1000.1, 1.0), (-3.7e5, 1.0), (0.3, 1e-7), (0.0, 1e-30)]),
    single=st.sampled_from([False, False, True]),
    fin=st.booleans(),
    slide=st.booleans(),
    bound=st.sampled_from([None, None, 0.01]),
    needles=st.booleans(),
)
def test_each_sweep_keeps_what_the_level_promises(
    choice, level, seed, kind, thrown, noise, where, single, fin, slide, bound, needles
):
    mesh = some_mesh(seed, kind, thrown, noise, where, single, fin)
    options = SmoothOptions(
        **choice, threads=1, slide=slide or None, feature_angle=60.0, surface_tolerance=0.3, hausdorff=bound,
        free_needles=needles,
    )  # fmt: skip
    method = options.smoother()
    state = first_state(mesh, None, method, options, serial)
    topology = state.topology
    assert isinstance(topology, Shell)
    assume(len(topology.free))
    field = Field(state.start.copy(), topology, state.precision, level, constraint=state.constraint)
    simplices = topology.changeable
    cells = simplices.cells if simplices.cells is not None else np.arange(len(simplices.rows))
    places = np.flatnonzero(topology.near_free)
    stars = [np.unique(cells[(simplices.rows == place).any(axis=1)]).tolist() for place in places]
    before = worth(field.points, simplices)
    for _ in range(SWEEPS):
        method.sweep(field, serial, lambda: False)
        after = worth(field.points, simplices)
        check(level, before, after, stars)
        before = after
    still = ~topology.near_free
    assert np.array_equal(field.points[still], state.start[still])


@pytest.mark.parametrize("level", range(3), ids=LEVELS)
@settings(max_examples=EXAMPLES, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    kind=st.sampled_from(["ball", "box", "triangle", "quad", "mixed"]),
    thrown=st.sampled_from([0.2, 0.4, 0.8]),
    grain=st.sampled_from([1e-2, 1e-3, 1e-4, 1e-6]),
)
def test_what_is_written_with_few_digits_keeps_the_level_too(level, seed, kind, thrown, grain):
    """Coordinates may be off by the grain that a file has, each one up or down: the extent of the mesh times this."""
    mesh = some_mesh(seed, kind, thrown, 0.0, (0.0, 1.0), False, False)
    options = SmoothOptions(method="barrier", threads=1, feature_angle=60.0, surface_tolerance=0.3)
    method = options.smoother()
    state = first_state(mesh, None, method, options, serial)
    topology = state.topology
    assert isinstance(topology, Shell)
    assume(len(topology.free))
    off = grain * float(np.ptp(state.start))
    precision = state.precision.coarser(0.0, off)
    field = Field(state.start.copy(), topology, precision, level, constraint=state.constraint)
    simplices = topology.changeable
    cells = simplices.cells if simplices.cells is not None else np.arange(len(simplices.rows))
    places = np.flatnonzero(topology.near_free)
    stars = [np.unique(cells[(simplices.rows == place).any(axis=1)]).tolist() for place in places]
    before, rng = worth(field.points, simplices), np.random.default_rng(seed)
    method.sweep(field, serial, lambda: False)
    moved = (field.points != state.start).any(axis=1)
    for _ in range(3):
        written = field.points.copy()
        written[moved] += off * rng.choice([-1.0, 1.0], written[moved].shape)
        check(level, before, worth(written, simplices), stars, True)


def test_shells_of_few_digits_move():
    """Fields of 8 columns far from the origin keep a two-thousandth of an edge."""
    mesh = wavy(12, 3, 0.4, "triangle")
    points = mesh.points * 96.0 / np.ptp(mesh.points[:, 0]) - [3000.0, 0.0, 0.0]
    grain = 0.005
    rounding = Rounding(0.0, grain, partial(_rounded, 2.0 * grain), "fields of 8 columns")
    mesh = Mesh(_rounded(2.0 * grain, points, None), mesh.cells, rounding=rounding)
    exact = gmsnet.smooth(replace(mesh, rounding=None), threads=1)
    found = gmsnet.smooth(mesh, threads=1)
    assert found.moved.any()
    assert found.points[:, 0].tolist() == _rounded(2.0 * grain, found.points, None)[:, 0].tolist()
    gain = [result.after.shape.min() - result.before.shape.min() for result in (found, exact)]
    assert gain[0] > 0.8 * gain[1] > 0.1


def _rounded(grid, points, nodes):
    """To multiples of a number."""
    return np.round(points / grid) * grid

"""What each level of the guard promises of tetrahedra, in exact arithmetic, after every sweep of every method.

GMSNET_GUARD_EXAMPLES: how many meshes for each method and level.
"""

from __future__ import annotations

import os
from fractions import Fraction
from functools import partial

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from support import surfaces, volumes
from support.choices import CHOICES, name_of

import gmsnet
from gmsnet import METHODS
from gmsnet.kernels.star.guard import LEVELS, STAR, VALID
from gmsnet.methods import Field, smoother
from gmsnet.parallel.threads import serial
from gmsnet.run.run import precision_of
from gmsnet.topology.ordering import space_points
from gmsnet.topology.volume import Volume

EXAMPLES = int(os.environ.get("GMSNET_GUARD_EXAMPLES", "6"))
SWEEPS = 2


def takes_tetrahedra(choice):
    return METHODS[choice["method"]].moves("tetra", choice.get("objective") or choice.get("variant"))


IN_SPACE = [choice for choice in CHOICES if takes_tetrahedra(choice)]
every_method = pytest.mark.parametrize("method", IN_SPACE, ids=list(map(name_of, IN_SPACE)))


def some_mesh(seed, kind, nodes, thrown, where, single):
    """Small volumes, perhaps with cells inverted, perhaps far from the origin, perhaps flat, in single precision."""
    rng = np.random.default_rng(seed)
    if kind == "ball":
        points, cells = volumes.ball(rng, nodes % 20 + 4, off=0.6, stretch=10.0 ** rng.uniform(-3, 0, 3))
    elif kind == "lattice":
        points, cells = volumes.lattice(3, 0.4, seed)
        points = points * 10.0 ** rng.uniform(-2, 0, 3)
    elif kind == "globe":
        points, cells = volumes.globe(nodes, seed)
        points = points @ surfaces.turned(seed % 99).T
    else:
        points, cells = volumes.cube(nodes, seed)
    if rng.random() < 0.5:
        cells = volumes.shuffled(rng, cells)
    regions = (points[cells].mean(axis=1)[:, 0] > 0.5).astype(int) if rng.random() < 0.2 else 0
    free = Volume.of(volumes.mesh_of(points, cells, regions)).free
    if thrown and len(free):
        some = rng.permutation(free)[:2]
        points[some] += thrown * rng.uniform(-1, 1, (len(some), 3)) * np.ptp(points, axis=0)
        if rng.random() < 0.3:
            points[some[0]] = points[cells[np.flatnonzero((cells == some[0]).any(axis=1))[0]][:1]]  # on a neighbour
    points = points * where[1] + where[0]
    mesh = volumes.mesh_of(np.float64(np.float32(points)) if single else points, cells, regions, single=single)
    assume(mesh.plane is None)  # float32 has made it flat
    return mesh


some_meshes = given(
    seed=st.integers(0, 2**32 - 1),
    slide=st.booleans(),
    kind=st.sampled_from(["ball", "lattice", "cube", "cube", "globe"]),
    nodes=st.integers(30, 50),
    thrown=st.sampled_from([0.0, 0.0, 0.1, 0.5]),
    where=st.sampled_from([(0.0, 1.0), (1000.1, 1.0), (-3.7e5, 1.0), (0.3, 1e-7), (1.0, 1e3), (0.0, 1e-30)]),
    single=st.sampled_from([False, False, True]),
)


def check(level, before, after, stars):
    """before, after: signed η³/432 of the cells with a free node. stars: rows of those around each free node."""
    for was, now in zip(before, after, strict=True):
        assert now > 0 or was <= 0
    assert sum(now <= 0 for now in after) <= sum(was <= 0 for was in before)
    if level != VALID:
        assert min(after) >= min(before)
    if level == STAR:
        for rows in stars:
            assert min(after[row] for row in rows) >= min(before[row] for row in rows)


@pytest.mark.parametrize("level", LEVELS)
@every_method
@some_meshes
@settings(max_examples=EXAMPLES, deadline=None)
def test_each_sweep_keeps_what_the_level_promises(method, level, seed, slide, kind, nodes, thrown, where, single):
    mesh = some_mesh(seed, kind, nodes, thrown, where, single)
    topology, on = surfaces.sliding(mesh, 60.0) if slide else (Volume.of(mesh), None)
    if not len(topology.free):
        return
    options = {**method}
    chosen = smoother(options.pop("method"), **options)
    start = space_points(mesh)[topology.memory]
    field = Field(start.copy(), topology, precision_of(mesh), LEVELS.index(level), constraint=on and on.constraint)
    cells, orientation = topology.changeable[:2]
    rows = [np.flatnonzero((cells == node).any(axis=1)) for node in np.flatnonzero(topology.near_free)]
    readings = [Fraction] if single else [Fraction, volumes.as_written]

    def exact():
        points = np.ldexp(field.points, mesh.exponent)
        return [volumes.exact_shapes(points, cells, orientation, reading) for reading in readings]

    before = exact()
    for _ in range(SWEEPS):
        chosen.sweep(field, serial, lambda: False)
        after = exact()
        for was, now in zip(before, after, strict=True):
            check(LEVELS.index(level), was, now, rows)
        held = ~topology.near_free
        assert field.points[held].tobytes() == start[held].tobytes()
        assert np.isfinite(field.points).all()
        assert not field.points[:, 3].any()
        before = after


@pytest.mark.parametrize("target", [{}, {"target_dihedral": 25.0}, {"target_quality": 0.5}], ids=str)
@pytest.mark.parametrize("level", LEVELS)
@some_meshes
@settings(max_examples=3 * EXAMPLES, deadline=None)
def test_so_does_the_whole_from_input_to_output_at_any_stop(
    level, target, seed, slide, kind, nodes, thrown, where, single
):
    mesh = some_mesh(seed, kind, nodes, thrown, where, single)
    rng = np.random.default_rng(seed)
    fixed = rng.random(len(mesh.points)) < 0.1
    topology, _ = surfaces.sliding(mesh, 60.0, fixed) if slide else (Volume.of(mesh, fixed), None)
    sweeps = int(rng.integers(0, 40))
    result = gmsnet.smooth(mesh, guard=level, max_sweeps=sweeps, fixed=fixed, slide=slide, feature_angle=60.0, **target)
    cells, orientation = topology.cells, topology.orientation
    changed = np.flatnonzero(np.isin(cells, topology.free).any(axis=1))
    still = np.setdiff1d(np.arange(len(mesh.points)), topology.free)
    assert mesh.points[still].tobytes() == result.points[still].tobytes()
    assert result.moved.tolist() == (result.points != mesh.points).any(axis=1).tolist()
    assert result.after.sign.tolist() == volumes.exact_signs(result.points, cells, orientation)
    if not len(changed):
        return
    stars = [np.flatnonzero((cells[changed] == node).any(axis=1)) for node in topology.free]
    if result.before.inverted:  # untangling, which comes before the sweeps, keeps no floors of stars
        stars = []
    of_mesh = partial(volumes.exact_shapes, cells=cells[changed], orientation=orientation[changed])
    for reading in [Fraction] if single else [Fraction, volumes.as_written]:
        before, after = (of_mesh(m.points, number=reading) for m in (mesh, result.mesh))
        check(LEVELS.index(level), before, after, stars)

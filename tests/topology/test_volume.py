"""The connectivity of tetrahedra: which nodes are free, why others are held, stars and colours."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import volumes
from support.same import same
from support.space import simplices_of

from gmsnet.errors import InputError
from gmsnet.kernels.star.space_blocks import LANES3
from gmsnet.parallel import memory as available_memory
from gmsnet.topology.volume import MOST, Volume
from gmsnet.topology.wound import Wound

BOUNDARY, INTERFACE, CHOSEN = "boundary", "interface between regions", "fixed by the user"
NO_SIDE, UNWOUND = "part of zero volume, which has no positive side", "part that cannot be wound consistently"
CURVED = "node of a second-order cell"
MARKED, FACE = "node of a line or vertex cell", "node of a face cell"
OTHER, UNUSED = "node of a cell that is not smoothed", "not used by any cell"


def counts(topology):
    return {reason: len(ids) for reason, ids in topology.held.items()}


def check_against_twin(mesh, topology, others=(), fixed=()):
    """Free nodes, each node once, and the orientation of what can be wound."""
    cells, nodes = mesh.cells[0].nodes, len(mesh.points)
    free = volumes.closed_balls(nodes, cells, mesh.cells[0].regions)
    free[[int(v) for v in others] + [int(v) for v in fixed]] = False
    part, turn, consistent = volumes.parts_of(cells)
    double = volumes.volumes6(mesh.points, cells) * turn if len(cells) else np.empty(0)
    for p, possible in enumerate(consistent):
        own = np.flatnonzero(np.array(part) == p)
        whole = double[own].sum()
        if abs(whole) <= 1e-9 * np.abs(double[own]).sum():
            free[cells[own].ravel()] = False
        elif possible:
            expected = np.array(turn)[own] * (1 if whole > 0 else -1)
            assert topology.orientation[own].tolist() == expected.tolist()
    assert topology.free.tolist() == np.flatnonzero(free).tolist()
    counted = [i for ids in topology.held.values() for i in ids.tolist()]
    assert sorted([*counted, *topology.free.tolist()]) == list(range(nodes))  # each node once


def check_stars(topology):
    """Each free node in one block, with each of its cells once; no two of a cell in one colour; lanes repeated."""
    blocks, first = topology.stars.blocks, topology.stars.first
    places = {int(p) for p in topology.places[topology.free]}
    cells = topology.near.tolist()
    seen = []
    for colour in range(topology.stars.colours):
        own = []
        for block in range(first[colour], first[colour + 1]):
            filled = int(blocks.filled[block])
            assert 1 <= filled <= LANES3
            most = 0
            for lane in range(LANES3):
                centre, ends = simplices_of(topology, block, lane)
                assert sorted(map(sorted, ends.tolist())) == sorted(
                    sorted(set(cell) - {centre}) for cell in cells if centre in cell
                )
                for row in ends.tolist():
                    cell = next(t for t, cell in enumerate(cells) if set(cell) == {centre, *row})
                    even = volumes.turns([cells[cell].index(n) for n in (centre, *row)])
                    assert even == (topology.near_orientation[cell] > 0)
                assert lane < filled or centre == own[-1]
                if lane < filled:
                    own.append(int(centre))
                most = max(most, len(ends))
            assert blocks.simplices[block] == most <= blocks.most_simplices
            assert blocks.degree[block] <= blocks.most
        for cell in cells:
            assert len(set(cell) & set(own)) <= 1
        assert [topology.near_colours[place] for place in own] == [colour] * len(own)
        seen += own
    assert sorted(seen) == sorted(places)


@given(
    seed=st.integers(0, 2**32 - 1), kind=st.sampled_from(["lattice", "cube"]), left=st.sampled_from([1.0, 0.98, 0.7]),
    regions=st.sampled_from([1, 1, 2]),
)  # fmt: skip
@settings(max_examples=40)
def test_free_nodes_of_meshes_with_holes_regions_and_mixed_orientation(seed, kind, left, regions):
    rng = np.random.default_rng(seed)
    points, cells = volumes.lattice(3, 0.3, seed) if kind == "lattice" else volumes.cube(60, seed)
    cells = rng.permutation(cells[rng.random(len(cells)) < left])
    if rng.random() < 0.5:
        cells = volumes.shuffled(rng, cells)
    if rng.random() < 0.2:
        cells = np.vstack([cells, cells[:1]])  # a duplicate
    if rng.random() < 0.2:
        points = np.vstack([points, [[5.0, 5.0, 5.0]]])  # a node that nothing uses
    region = (points[cells].mean(axis=1)[:, 0] > 0.5).astype(int) if regions == 2 else 0
    fixed = rng.random(len(points)) < 0.1 if rng.random() < 0.3 else None
    mesh = volumes.mesh_of(points, cells, region)
    topology = Volume.of(mesh, fixed)
    check_against_twin(mesh, topology, fixed=[] if fixed is None else np.flatnonzero(fixed))
    if len(topology.free) < 40:
        check_stars(topology)
    halves = Volume.made(Wound.of(mesh, fixed, threads=2), threads=2)
    assert same(halves, topology)


def test_stars_and_colours_of_a_random_cube():
    mesh = volumes.mesh_of(*volumes.cube(150, 4))
    topology = Volume.of(mesh)
    check_against_twin(mesh, topology)
    assert len(topology.free) > LANES3
    check_stars(topology)


def test_stars_of_some_nodes():
    topology = Volume.of(volumes.mesh_of(*volumes.cube(200, 5)))
    chosen = topology.places[topology.free[::3]].astype(np.int64)
    stars = topology.stars_of(chosen)
    filled = [
        int(stars.blocks.centre[block * LANES3 + lane])
        for block in range(len(stars.blocks.filled))
        for lane in range(stars.blocks.filled[block])
    ]
    assert sorted(filled) == sorted(chosen.tolist())
    nobody = topology.stars_of(np.empty(0, dtype=np.int64))
    assert (len(nobody.blocks.filled), nobody.colours) == (0, 0)


def test_reasons_of_a_lattice():
    points, cells = volumes.lattice(3, 0.2)
    mesh = volumes.mesh_of(points, cells)
    assert counts(Volume.of(mesh)) == {BOUNDARY: 56}
    fixed = np.zeros(64, dtype=bool)
    fixed[[0, 21]] = True
    assert counts(Volume.of(mesh, fixed)) == {BOUNDARY: 56, CHOSEN: 1}
    held = Volume.of(mesh).holding(fixed, "because")
    assert counts(held) == {BOUNDARY: 56, "because": 1}
    assert 21 not in held.free
    assert held.near_colours[held.places[21]] == -1
    assert held.holding(fixed, "again") is held


def test_marker_triangles_and_lines_hold_their_nodes_and_tell_nothing_else():
    points, cells = volumes.lattice(3, 0.2)
    inner = [21, 22, 25]
    marked = volumes.mesh_of(points, cells, more=[("triangle", [inner], 7), ("line", [inner[:2]], 3)])
    topology = Volume.of(marked)
    assert (
        set(topology.free) == {26, 37, 38, 41, 42} == set(Volume.of(volumes.mesh_of(points, cells)).free) - set(inner)
    )
    assert counts(topology) == {BOUNDARY: 56, MARKED: 2, FACE: 1}
    vertex = volumes.mesh_of(points, cells, more=[("vertex", [[41]], 7)])
    assert counts(Volume.of(vertex)) == {BOUNDARY: 56, MARKED: 1}


def test_cells_of_other_kinds_hold_their_nodes():
    points, cells = volumes.lattice(3, 0.2)
    at = 5 + len(points)
    prism = np.array([[0, 0, 2], [1, 0, 2], [0, 1, 2], [0, 0, 3], [1, 0, 3], [0, 1, 3.0]])
    mesh = volumes.mesh_of(
        np.vstack([points, prism]), cells, more=[("wedge", [[*range(at - 5, at + 1)]]), ("tetra10", [range(20, 30)])]
    )
    topology = Volume.of(mesh)
    assert counts(topology) == {BOUNDARY: 56, OTHER: 6, CURVED: 4}  # of the lattice 21, 22, 25 and 26
    assert len(topology.cell) == len(cells)


def test_where_each_cell_is_in_the_file():
    points, cells = volumes.lattice(2, 0.2)
    first, second = cells[:20], cells[20:]
    mesh = volumes.mesh_of(points, first, more=[("triangle", [[0, 1, 3]]), ("tetra", second, 1)])
    topology = Volume.of(mesh)
    assert topology.cell.tolist() == [*range(20), *range(21, len(cells) + 1)]
    assert topology.cells.tolist() == cells.tolist()
    assert topology.near_origin[np.argsort(topology.near_origin)].tolist() == list(range(len(cells)))
    assert (topology.places[topology.cells[topology.near_origin]] == topology.near).all()
    assert INTERFACE in topology.held


@pytest.mark.parametrize("mirror", [1, -1])
def test_files_that_are_inside_out_and_files_of_mixed_orientation(mirror):
    rng = np.random.default_rng(0)
    points, cells = volumes.lattice(3, 0.2)
    points = points * [1, 1, mirror]
    plain = Volume.of(volumes.mesh_of(points, cells))
    assert plain.orientation.tolist() == [mirror] * len(cells)
    mixed = volumes.shuffled(rng, cells)
    topology = Volume.of(volumes.mesh_of(points, mixed))
    assert (topology.orientation * volumes.volumes6(points, mixed) > 0).all()
    assert topology.free.tolist() == plain.free.tolist()


def test_parts_are_wound_each_by_itself():
    points, cells = volumes.lattice(3, 0.2)
    apart = np.vstack([points, points * [1, 1, -1] + [0, 0, -3.0], points + np.array([9, 0, 0])])
    mesh = volumes.mesh_of(apart, np.vstack([cells, cells + 64, cells[:, [1, 0, 2, 3]] + 128]))
    topology = Volume.of(mesh)
    assert topology.orientation.tolist() == [1] * len(cells) + [-1] * 2 * len(cells)
    assert len(topology.free) == 24
    check_against_twin(mesh, topology)


def test_a_few_inverted_cells_do_not_turn_the_others():
    points, cells = volumes.lattice(4, 0.2)
    inner = np.flatnonzero(((points > 0) & (points < 1)).all(axis=1))
    points[inner[0]] += 0.6
    mesh = volumes.mesh_of(points, cells)
    topology = Volume.of(mesh)
    assert (volumes.volumes6(points, cells) < 0).any()
    assert topology.orientation.tolist() == [1] * len(cells)
    assert len(topology.free) == len(inner)


def test_facets_of_three_cells_and_cells_that_are_there_twice():
    points, cells = volumes.lattice(4, 0.2)
    inner = np.flatnonzero(((points > 0) & (points < 1)).all(axis=1))
    twice = volumes.mesh_of(points, np.vstack([cells, cells[:1], cells[np.isin(cells, inner).all(axis=1)][:1]]))
    topology = Volume.of(twice)
    check_against_twin(twice, topology)
    assert counts(topology)["non-manifold facet"] == 4
    all_twice = volumes.mesh_of(points, np.vstack([cells, cells]))
    assert not len(Volume.of(all_twice).free)
    extra = volumes.mesh_of(np.vstack([points, [[0.5, 0.5, 0.5]]]), np.vstack([cells, [[*cells[70][:3], len(points)]]]))
    check_against_twin(extra, Volume.of(extra))


def test_balls_that_touch_in_an_edge_or_a_node():
    """Two closed balls at one node, glued at nothing else and along an edge, are not one."""
    rng = np.random.default_rng(1)
    first, cells = volumes.ball(rng, 8)
    second, more = volumes.ball(rng, 9)
    for shared in ([0], [0, 1]):
        to = np.arange(len(first), len(first) + len(second))
        to[shared] = shared
        mesh = volumes.mesh_of(np.vstack([first, second]), np.vstack([cells, to[more]]))
        topology = Volume.of(mesh)
        assert not len(topology.free)
        assert 0 in topology.held["star is not one closed ball"]
        check_against_twin(mesh, topology)


def test_a_ring_of_cells_around_an_edge_is_no_ball():
    """Its nodes are all on the boundary; a Möbius band of cells cannot be wound."""
    count = 8
    angle = 2 * np.pi * np.arange(count) / count
    rim = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    points = np.vstack([[[0, 0, -1], [0, 0, 1.0]], rim])
    around = np.arange(count)
    cells = np.column_stack([0 * around, 0 * around + 1, 2 + around, 2 + (around + 1) % count])
    assert counts(Volume.of(volumes.mesh_of(points, cells))) == {BOUNDARY: 10}


def test_cells_that_cannot_be_wound():
    """The cells around all faces of a projective plane: the cone over it has no consistent orientation."""
    triangles = [
        (0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 5), (0, 5, 1), (1, 2, 4), (2, 3, 5), (3, 4, 1), (4, 5, 2), (5, 1, 3),
    ]  # fmt: skip
    points = np.random.default_rng(2).normal(size=(7, 3))
    mesh = volumes.mesh_of(points, [(6, *t) for t in triangles])
    topology = Volume.of(mesh)
    assert not len(topology.free)
    assert counts(topology) == {BOUNDARY: 6, UNWOUND: 1}
    check_against_twin(mesh, topology)


def test_a_part_without_volume_has_no_positive_side():
    """The same ball read once forth and once back, as two parts of which one is folded flat."""
    rng = np.random.default_rng(3)
    points, cells = volumes.ball(rng, 10)
    flat = points * [1, 1, 0] + [5, 0, 0]
    mesh = volumes.mesh_of(np.vstack([points, flat]), np.vstack([cells, cells + len(points)]))
    topology = Volume.of(mesh)
    assert topology.free.tolist() == [0]
    assert topology.held[NO_SIDE].tolist() == [len(points)]


@pytest.mark.parametrize(("around", "held"), [(MOST, False), (MOST + 1, True), (600, True)])
def test_hubs(around, held):
    rng = np.random.default_rng(4)
    points, cells = volumes.ball(rng, around)
    topology = Volume.of(volumes.mesh_of(points, cells))
    assert len(points) == around + 1
    assert (topology.free.tolist() == [0]) != held
    assert ("more than 255 neighbours" in topology.held) == held
    if not held:
        check_stars(topology)


def test_nodes_that_nothing_uses():
    points, cells = volumes.lattice(2, 0.2)
    mesh = volumes.mesh_of(np.vstack([[[9.0, 9, 9]], points, [[7.0, 7, 7]]]), cells + 1)
    topology = Volume.of(mesh)
    assert counts(topology) == {UNUSED: 2, BOUNDARY: 26}
    assert topology.free.tolist() == [14]


def test_cells_that_name_a_node_twice_free_none_of_theirs():
    points, cells = volumes.lattice(3, 0.2)
    for bad in combinations([21, 21, 22, 25, 25], 4):
        mesh = volumes.mesh_of(points, np.vstack([cells, [bad]]))
        topology = Volume.of(mesh)
        assert not set(bad) & set(topology.free.tolist())


def test_flat_and_two_dimensional_files_are_refused():
    points, cells = volumes.lattice(2)
    for flat in (points[:, :2], points * [1, 0, 1], points * [1, 1, 1e-11]):
        with pytest.raises(InputError, match="lie in one plane: check the file's coordinates"):
            Volume.of(volumes.mesh_of(flat, cells))


def test_what_does_not_fit_is_refused(monkeypatch):
    points, cells = volumes.lattice(2)
    monkeypatch.setattr(available_memory, "available", lambda: 1000)
    monkeypatch.setattr(available_memory, "ALWAYS_FREE", 0)
    with pytest.raises(InputError, match="the connectivity of 48 tetrahedra"):
        Volume.of(volumes.mesh_of(points, cells))

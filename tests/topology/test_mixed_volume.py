"""The connectivity of hexahedra, wedges and pyramids: what is free, why the rest is held, stars and colours."""

import numpy as np
import pytest
from support import blocks

from gmsnet.cells.table import CELLS
from gmsnet.kernels.simplex.mean_ratio3 import REGULAR, WEIGHTS3
from gmsnet.kernels.star.space_blocks import LANES3
from gmsnet.measure.report import connectivity_of
from gmsnet.mesh.mesh import Mesh
from gmsnet.topology.solids import KINDS

MESHES = {
    "hexahedra": blocks.block(4, 4, 3, jitter=0.1),
    "wedges": blocks.block(4, 4, 3, wedges=[(i, j) for i in range(4) for j in range(4)], jitter=0.1),
    "pyramids": blocks.block(3, 3, 3, pyramids=[(1, 1, 1), (0, 1, 2)], jitter=0.1),
    "all": blocks.block(4, 4, 4, wedges=[(0, 0), (2, 1)], pyramids=[(1, 1, 1), (3, 3, 3)], jitter=0.1),
}
every_mesh = pytest.mark.parametrize("mesh", MESHES.values(), ids=MESHES.keys())


@pytest.mark.parametrize("kind", KINDS)
def test_weights_are_those_of_the_ideal_cell(kind):
    for inverse in CELLS[kind].ideal:
        inverse = np.array(inverse)
        gram = inverse @ inverse.T
        opposite = [-gram[0, 1], -gram[1, 2], -gram[2, 0]]
        share = REGULAR / (3.0 * np.linalg.det(inverse) ** (2.0 / 3.0))
        expected = [*gram.sum(axis=1) * share, *np.array(opposite) * share]
        np.testing.assert_allclose(WEIGHTS3[KINDS.index(kind)], expected, atol=1e-15)
        assert np.abs(WEIGHTS3[KINDS.index(kind)]).sum() <= 9.0 + 1e-12  # which the error bounds use


@every_mesh
def test_inner_nodes_are_free_and_the_others_are_held_as_boundary(mesh):
    topology = connectivity_of(mesh)
    assert set(topology.free) == set(np.flatnonzero(blocks.inner_nodes(mesh)))
    assert {reason: len(nodes) for reason, nodes in topology.held.items()} == {
        "boundary": len(mesh.points) - len(topology.free)
    }


@every_mesh
def test_no_two_free_nodes_of_one_cell_share_a_colour(mesh):
    topology = connectivity_of(mesh)
    colours = topology.near_colours[topology.places]
    for cells in mesh.cells:
        for nodes in cells.nodes:
            own = colours[nodes][colours[nodes] >= 0]
            assert len(set(own)) == len(own)


@every_mesh
def test_stars_have_the_corner_simplices_of_all_cells_at_a_node(mesh):
    """By D and S of each, as the ideal cell says, and the cell."""
    topology = connectivity_of(mesh)
    expected = {}
    first = 0
    for cells in mesh.cells:
        for t, nodes in enumerate(cells.nodes):
            for simplex, inverse in zip(CELLS[cells.kind].simplices, np.array(CELLS[cells.kind].ideal), strict=True):
                corner, *ends = mesh.points[nodes[list(simplex)]]
                spokes = (np.array(ends) - corner).T
                share = REGULAR / (3.0 * np.linalg.det(inverse) ** (2.0 / 3.0))
                pair = np.linalg.det(spokes), share * ((spokes @ inverse) ** 2).sum()
                for node in nodes[list(simplex)]:
                    expected.setdefault(int(node), []).append((*pair, first + t))
        first += len(cells.nodes)
    made, seen = topology.stars.blocks, set()
    for block, count in enumerate(made.filled):
        for lane in range(count):
            found = _star(mesh, topology, block, lane)
            node = int(topology.memory[made.centre[block * LANES3 + lane]])
            np.testing.assert_allclose(in_order(found), in_order(expected[node]), rtol=1e-9, atol=1e-12)
            seen.add(node)
    assert seen == set(topology.free)


def in_order(rows):
    return sorted(rows, key=lambda row: (row[2], round(row[0], 9), round(row[1], 9)))


def _star(mesh, topology, block, lane):
    made, points = topology.stars.blocks, mesh.points[topology.memory]
    mixture, begin, number = made.mixture, made.at[block], block * LANES3 + lane
    ring = made.ring[made.offset[block] :][: LANES3 * made.degree[block]].reshape(-1, LANES3)[:, lane]
    found = []
    for k in range(made.simplices[block]):
        row = begin // (3 * LANES3) + k
        if not mixture.present[row] >> lane & 1:
            continue
        a, b, c = points[ring[made.spoke[begin + (3 * k + np.arange(3)) * LANES3 + lane]]] - points[made.centre[number]]
        squares = [(v**2).sum() for v in (a, b, c, b - a, c - b, a - c)]
        cell = topology.cells_of(np.flatnonzero(topology.simplices.cells == mixture.owner[row * LANES3 + lane])[:1])[0]
        found.append((np.linalg.det([a, b, c]), mixture.exact[mixture.role[row]] @ squares, cell))
    assert len(found) == made.cells[number]
    return found


@every_mesh
def test_cells_inside_out_as_a_whole_are_read_the_other_way_round(mesh):
    mirrored = Mesh(mesh.points * [1.0, 1.0, -1.0], mesh.cells)
    topology, plain = connectivity_of(mirrored), connectivity_of(mesh)
    assert (topology.orientation == -1).all()
    assert set(topology.free) == set(plain.free)
    assert topology.inside_out().any()
    assert not plain.inside_out().any()


def test_one_cell_inside_out_among_others_is_read_as_they_are():
    mesh = blocks.block(3, 3, 3)
    nodes = mesh.cells[0].nodes.copy()
    nodes[13] = nodes[13][[4, 5, 6, 7, 0, 1, 2, 3]]
    topology = connectivity_of(Mesh(mesh.points, [blocks.cells_of("hexahedron", nodes)]))
    assert np.flatnonzero(topology.orientation < 0).tolist() == [13]
    assert len(topology.free) == 8


def test_quadrilaterals_against_two_triangles_are_held_for_that():
    points, cells, at = blocks.lattice(3, 3, 2)
    wedges = [
        part for a, b, c, d, e, f, g, h in cells[at[:, 2] == 1] for part in ((a, b, c, e, f, g), (a, c, d, e, g, h))
    ]
    topology = connectivity_of(
        Mesh(points, [blocks.cells_of("hexahedron", cells[at[:, 2] == 0]), blocks.cells_of("wedge", wedges)])
    )
    inner = np.flatnonzero(((points > 0) & (points < (3, 3, 2))).all(axis=1))
    assert topology.held["facet against others of other nodes"].tolist() == inner.tolist()
    assert not len(topology.free)


def test_a_cell_that_names_a_node_twice_is_held():
    mesh = blocks.block(3, 3, 3)
    nodes = mesh.cells[0].nodes.copy()
    nodes[13, 6] = nodes[13, 5]
    topology = connectivity_of(Mesh(mesh.points, [blocks.cells_of("hexahedron", nodes)]))
    assert not len(topology.free)


def test_cells_that_meet_in_an_edge_alone_are_no_ball():
    points, cells, _ = blocks.lattice(2, 2, 1)
    topology = connectivity_of(Mesh(points, [blocks.cells_of("hexahedron", cells[[0, 3]])]))
    assert not len(topology.free)

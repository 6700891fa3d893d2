"""Second-order cells that held nodes alone keep from being valid are told from all others."""

from __future__ import annotations

import numpy as np
import pytest
from support import solid

from gmsnet.cells.jacobian import derivatives_on_edges
from gmsnet.cells.table import CELLS
from gmsnet.kernels.simplex.bernstein import KINDS
from gmsnet.topology.curved_solids import CURVED
from gmsnet.untangle.curved_corners import bad_for_good

PARTS = 4


def one_cell(name, points, free, names):
    cells = np.arange(len(points), dtype=np.int32)[None]
    return bool(bad_for_good(points, cells, np.array([names.index(name)]), names, free)[0])


@pytest.mark.parametrize("name", CURVED)
def test_derivatives_are_those_of_the_map(name):
    """Of x ↦ x they are the identity; of a quadratic function they are its derivatives, in exact arithmetic."""
    weights, kind = derivatives_on_edges(name, PARTS), CELLS[name]
    nodes = np.array([[float(x) for x in row] for row in solid.reference_nodes(name)])
    np.testing.assert_allclose(weights @ nodes, np.broadcast_to(np.eye(3), (len(weights), 3, 3)), atol=1e-12)
    shares = np.linspace(0, 1, PARTS + 1)[:, None]
    places = np.concatenate([nodes[edge[0]] * (1 - shares) + nodes[edge[1]] * shares for edge in kind.edges])
    x, y, z = nodes.T
    found = weights @ (x * x + 2 * x * y - 3 * y * z + z * z)
    x, y, z = places.T
    np.testing.assert_allclose(found, np.stack([2 * x + 2 * y, 2 * x - 3 * z, 2 * z - 3 * y], axis=1), atol=1e-12)


@pytest.mark.parametrize("name", CURVED)
def test_on_an_edge_the_two_facets_beside_it_decide(name):
    kind, weights = CELLS[name], derivatives_on_edges(name, PARTS)
    for number, edge in enumerate(kind.edges):
        beside = set().union(*(facet for facet in kind.facets if {*edge[:2]} <= {*facet}))
        here = weights[number * (PARTS + 1) : (number + 1) * (PARTS + 1)]
        others = [node for node in range(kind.nodes) if node not in beside]
        assert np.abs(here[:, :, others]).max(initial=0.0) < 1e-12


@pytest.mark.parametrize("name", CURVED)
def test_a_fold_on_a_held_edge_is_for_good_and_where_a_node_is_free_it_is_not(name):
    kind = CELLS[name]
    points = np.array([[float(x) for x in row] for row in solid.reference_nodes(name)])
    edge = kind.edges[0]
    beside = np.array(sorted(set().union(*(facet for facet in kind.facets if {*edge[:2]} <= {*facet}))))
    free = np.ones(len(points), dtype=bool)
    assert not one_cell(name, points, ~free, CURVED)  # valid
    folded = points.copy()
    folded[edge[2]] += 1.5 * (points[edge[1]] - points[edge[0]])  # the middle beyond an end
    assert not one_cell(name, folded, free, CURVED)
    free[beside] = False
    assert one_cell(name, folded, free, CURVED)
    assert not one_cell(name, points, free, CURVED)
    free[edge[2]] = True  # of an end the derivatives vanish somewhere on the edge
    assert not one_cell(name, folded, free, CURVED)


@pytest.mark.parametrize("name", [name for name in KINDS if CELLS[name].order == 2])
def test_a_held_corner_of_a_plane_is_for_good(name):
    kind = CELLS[name]
    turn = 2 * np.pi * np.arange(kind.corners) / kind.corners
    corner = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    middles = [corner[list(edge[:2])].mean(axis=0) for edge in kind.edges]
    points = np.vstack([corner, middles, corner.mean(axis=0)])[: kind.nodes]
    free = np.zeros(len(points), dtype=bool)
    free[kind.corners + 1] = True  # the middle of the second edge, from corner 1 to 2
    assert not one_cell(name, points, free, KINDS)
    points[kind.corners] = 2.0 * points[0] - points[1]  # the first edge starts in the wrong direction
    assert one_cell(name, points, free, KINDS)
    free[kind.corners] = True
    assert not one_cell(name, points, free, KINDS)


def test_a_straight_cell_beside_them_is_for_good_where_three_nodes_are_held():
    points, free = np.array([[0.0, 0], [1, 0], [1, 1], [0.6, 0.2]]), np.array([False, False, False, True])
    cells, kinds = np.array([[0, 1, 2, 3, -1, -1, -1, -1, -1]], dtype=np.int32), np.array([KINDS.index("quad")])
    assert not bad_for_good(points, cells, kinds, KINDS, free)[0]
    points[2] = (1.0, -1.0)
    assert bad_for_good(points, cells, kinds, KINDS, free)[0]

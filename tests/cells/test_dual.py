"""Facets around corners, and what makes a cell regular."""

import numpy as np
import pytest

from gmsnet.cells.dual import dual_places, facets_around, ideal_corners, regularising
from gmsnet.cells.table import CELLS

KINDS = ("tetra", "hexahedron", "wedge", "pyramid")


@pytest.mark.parametrize("name", KINDS)
def test_all_edges_of_an_ideal_cell_are_equally_long(name):
    kind = CELLS[name]
    corners = ideal_corners(kind)
    np.testing.assert_allclose([np.linalg.norm(corners[i] - corners[j]) for i, j in kind.edges], 1.0, atol=1e-14)


@pytest.mark.parametrize("name", KINDS)
def test_facets_that_follow_each_other_share_an_edge_at_the_corner(name):
    kind = CELLS[name]
    for corner, facets in enumerate(facets_around(kind)):
        assert sorted(facets) == [k for k, facet in enumerate(kind.facets) if corner in facet]
        for one, other in zip(facets, (*facets[1:], facets[0]), strict=True):
            shared = {corner, *kind.facets[one]} & set(kind.facets[other])
            assert len(shared) == 2
            end = next(node for node in shared if node != corner)
            first = kind.facets[one]
            assert first[first.index(corner) - 1] == end  # so they turn counter-clockwise


@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize("free", [0.5, 2.0])
def test_an_ideal_cell_keeps_its_shape(name, free):
    kind = CELLS[name]
    corners = ideal_corners(kind)
    means, normals = dual_places(kind, corners)
    outward = corners - corners.mean(axis=0)
    assert (np.einsum("ij,ij->i", normals, outward) > 0).all()
    moved = means + regularising(kind, free) * normals
    moved -= moved.mean(axis=0)
    share = np.linalg.norm(moved) / np.linalg.norm(outward)
    np.testing.assert_allclose(moved, share * outward, atol=1e-14)


def test_what_sigma_is_free_is_told_by_symmetry():
    assert [regularising(CELLS[name], 3.25) == 3.25 for name in KINDS] == [True, True, False, False]
    assert regularising(CELLS["pyramid"], 1.0) == pytest.approx(1 / 6)

"""Regions that mean nothing: nodes of interfaces between them move as all others do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.blocks import block
from support.surface_meshes import halves, wavy

import gmsnet
import gmsnet.generate
from gmsnet.errors import InputError
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.topology.held import OF_LINE, ON_BOUNDARY, ON_INTERFACE

PLANE = gmsnet.generate.random_quad_mesh(400, seed=3, cells="mixed")
MESHES = {
    "plane": PLANE,
    "surface": wavy(14, 1),
    "tetrahedra": gmsnet.generate.random_volume(400, seed=2),
    "hexahedra": block(5, 5, 5, jitter=0.2, seed=1),
}


@pytest.mark.parametrize("kind", MESHES)
def test_the_result_is_that_of_one_region(kind):
    one, two = MESHES[kind].with_one_region(), halves(MESHES[kind])
    assert len(gmsnet.smooth(two, max_sweeps=0).held[ON_INTERFACE])
    result, whole = gmsnet.smooth(two, join_regions=True), gmsnet.smooth(one)
    assert ON_INTERFACE not in result.held
    assert np.array_equal(result.points, whole.points)
    assert [each.regions.tolist() for each in result.mesh.cells] == [each.regions.tolist() for each in two.cells]


def test_nodes_of_markers_between_regions_stay():
    two = halves(PLANE.with_one_region())
    between = gmsnet.smooth(two, max_sweeps=0).held[ON_INTERFACE]
    edges = np.concatenate([np.stack([each.nodes, np.roll(each.nodes, -1, axis=1)], axis=2).reshape(-1, 2)
                            for each in two.cells if each.dimension == 2])  # fmt: skip
    edges = edges[np.isin(edges, between).all(axis=1)]
    marked = replace(two, cells=(*two.cells, CellBlock("line", edges, np.full(len(edges), 9))))
    result = gmsnet.smooth(marked, join_regions=True)
    assert not result.moved[edges].any()
    assert np.isin(edges, np.concatenate([result.held[OF_LINE], result.held[ON_BOUNDARY]])).all()


def test_names_of_regions_still_hold_their_nodes():
    two = replace(halves(PLANE), region_names={**PLANE.region_names, (2, 1): "left"})
    left = two.markers["left"]
    result = gmsnet.smooth(two, join_regions=True, fixed="left")
    assert not result.moved[left].any()
    assert result.moved.any()


def test_it_must_be_true_or_false():
    with pytest.raises(InputError, match="join_regions must be True or False"):
        gmsnet.smooth(PLANE, join_regions="all")

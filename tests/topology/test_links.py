"""What is taken of corner simplices and how stars are counted, beside slow twins."""

from __future__ import annotations

import numpy as np
import pytest

from gmsnet.generate import hybrid_mesh, random_quad_mesh
from gmsnet.topology import links
from gmsnet.topology.topology import Topology


@pytest.mark.parametrize("few", [links.FEW, 0])
def test_kinds_of_stars_are_numbered_in_their_order(few, monkeypatch):
    monkeypatch.setattr(links, "FEW", few)  # 0: too many for a table
    rng = np.random.default_rng(3)
    triangles, quads = rng.integers(0, 7, (2, 500)).astype(np.int32)
    both = (triangles > 0) & (quads > 0) | (rng.random(500) < 0.1)
    found, number = links.kinds_of(triangles, quads, both)
    stars = list(zip(triangles.tolist(), quads.tolist(), both.tolist(), strict=True))
    wanted = sorted({(0, 0, False), *stars}, key=lambda kind: (kind[2], kind[0], kind[1]))
    assert found == wanted
    assert number.dtype == np.int32
    assert number.tolist() == [wanted.index(star) for star in stars]


def test_there_is_a_kind_of_no_cells_where_there_are_no_stars():
    nothing = np.zeros(0, dtype=np.int32)
    found, number = links.kinds_of(nothing, nothing, nothing > 0)
    assert (found, len(number)) == ([(0, 0, False)], 0)


@pytest.mark.parametrize("held", [0.0, 0.5, 0.97, 1.0])
@pytest.mark.parametrize("mesh", [random_quad_mesh(150, seed=1), hybrid_mesh(150, seed=1)])
def test_scored_and_changeable_are_those_of_the_cells_with_a_free_node(mesh, held):
    fixed = np.random.default_rng(5).random(len(mesh.points)) < held
    topology = Topology.of(mesh, fixed)
    every, free = topology.simplices, topology.near_free
    movable = [bool(free[row].any()) for row in every.rows]
    cells = {cell for cell, moves in zip(every.cells.tolist(), movable, strict=True) if moves}
    whole = [cell in cells for cell in every.cells.tolist()]
    for found, chosen in ((topology.changeable, movable), (topology.scored, whole)):
        for name in every._fields:
            wanted = getattr(every, name)[np.array(chosen)]
            assert getattr(found, name).dtype == wanted.dtype
            assert (getattr(found, name) == wanted).all()
        assert found.cell_count == len(set(every.cells[np.array(chosen)].tolist()))

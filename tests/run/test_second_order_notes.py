"""What is said of meshes of second-order cells beside straight ones: counts that add up, lines that agree."""

from __future__ import annotations

import re

import numpy as np
import pytest

import gmsnet
from gmsnet.generate import random_mesh
from gmsnet.generate.curved import second_order, throw
from gmsnet.generate.curved_volumes import second_order_volume
from gmsnet.generate.volumes import lattice_volume
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

CORNERS = {"triangle6": 3, "tetra10": 4}


def half_straight(mesh):
    """The mesh with straight cells where x of the mean of the corners is above one half."""
    (block,) = (block for block in mesh.cells if block.kind in CORNERS)
    count = CORNERS[block.kind]
    left = mesh.points[block.nodes[:, :count]].mean(axis=1)[:, 0] < 0.5
    curved, straight = block.nodes[left], block.nodes[~left, :count]
    used, nodes = np.unique(np.concatenate([curved.ravel(), straight.ravel()]), return_inverse=True)
    blocks = zip((block.kind, "triangle" if count == 3 else "tetra"), (curved, straight),
                 np.split(nodes.ravel(), [curved.size]), strict=True)  # fmt: skip
    return Mesh(mesh.points[used], tuple(
        CellBlock(kind, of.reshape(rows.shape), np.ones(len(rows), dtype=int)) for kind, rows, of in blocks
    ))  # fmt: skip


def note_with(result, text):
    """The notes with a text."""
    return [note for note in result.notes if text in note]


@pytest.mark.parametrize("slide", [False, True])
def test_what_is_mended_after_untangling_is_not_told_to_be_left(slide):
    base = random_mesh(80, seed=3)
    thrown = throw(second_order(Mesh(base.points, base.cells)), middles=0.1, corners=1.0, seed=3)
    mesh = half_straight(thrown)
    done = gmsnet.smooth(mesh, slide=slide)
    (untangled,) = note_with(done, "untangling: ")
    assert "inverted cells are left" in untangled
    assert untangled.endswith("; in the end none is inverted")
    assert done.after.inverted == done.invalid_curved == 0
    (curved,) = note_with(done, "second order: ")
    for moved, free in re.findall(r"(\d+) of (\d+) free", curved):
        assert int(moved) <= int(free)
    assert (int(re.findall(r"of (\d+) free corners", curved)[0]) > 80) == slide


def test_a_curved_cell_that_is_invalid_is_no_work_of_untangling():
    volume = lattice_volume(3)
    mesh = half_straight(second_order_volume(volume, bend=0.35, seed=1))
    done = gmsnet.smooth(mesh)
    (curved,) = note_with(done, "second order: ")
    assert int(re.findall(r"(\d+) invalid cells? before", curved)[0]) > 0
    assert not note_with(done, "untangling: ")

"""Files of single precision: how exactly their coordinates are known, and how much room that leaves."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from support.blocks import block
from support.quads import doubled_area
from support.quads import valid as valid_quad
from support.ranks import parts_at_random, spread
from support.same import same
from support.volumes import lattice

import gmsnet
from gmsnet.mesh.mesh import CellBlock, Mesh
from gmsnet.run.options import SmoothOptions

FAR = 16384.0  # where float32 numbers are 1/512 apart
SIDE = 1.0 / 25.0


def grid(kind, n=12, seed=0):
    """A grid of squares, its inner nodes thrown, far from the origin: cells of some twenty of the last digits."""
    x, y = np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0))
    points = np.column_stack([x.ravel(), y.ravel()])
    inner = ((points > 0) & (points < n)).all(axis=1)
    points += inner[:, None] * np.random.default_rng(seed).uniform(-0.3, 0.3, points.shape)
    corner = np.arange(n * (n + 1)).reshape(n, n + 1)[:, :-1].ravel()
    cells = np.stack([corner, corner + 1, corner + n + 2, corner + n + 1], axis=1)
    if kind == "triangle":
        cells = np.concatenate([cells[:, [0, 1, 2]], cells[:, [0, 2, 3]]])
    return Mesh(SIDE * points + FAR, (CellBlock(kind, cells, np.zeros(len(cells))),))


def rounded(mesh):
    """As a binary file of single precision keeps it."""
    return replace(mesh, points=mesh.points.astype(np.float32).astype(float), single=True)


def is_valid(points, mesh):
    """In exact arithmetic."""
    at = [tuple(map(Fraction, place)) for place in points.tolist()]
    cells = mesh.cells[0].nodes.tolist()
    return all(valid_quad(at, cell) if len(cell) == 4 else doubled_area(at, cell) > 0 for cell in cells)


@pytest.mark.parametrize(("kind", "least"), [("quad", 0.99), ("triangle", 0.8)])
@pytest.mark.parametrize("method", ["auto", "barrier", "laplacian", "worst-first", "getme"])
def test_rounding_in_a_plane_takes_no_room(kind, least, method):
    mesh = rounded(grid(kind))
    assert mesh.exact
    result = gmsnet.smooth(mesh, method)
    assert (result.points == result.points.astype(np.float32)).all()
    assert is_valid(result.points, mesh)
    assert result.after.shape.min() >= result.before.shape.min()
    if method == "auto":
        assert result.before.shape.min() < 0.5
        assert result.after.shape.min() > least


@pytest.mark.parametrize(
    "cut", [{}, {"wedges": [(1, 1), (2, 2)]}, {"pyramids": [(1, 1, 1), (2, 2, 2)]}], ids=["hexes", "wedges", "pyramids"]
)
def test_rounding_in_space_takes_no_room(cut):
    near = block(4, 4, 4, jitter=0.25, **cut)
    best = gmsnet.smooth(near).judged.after
    far = rounded(replace(near, points=near.points * SIDE + FAR))
    result = gmsnet.smooth(far)
    assert result.judged.before.shape_min < 0.65
    assert result.judged.after.shape_min > best.shape_min - 0.02
    assert (result.points == result.points.astype(np.float32)).all()
    assert result.after.inverted == 0


def test_rounding_of_tetrahedra_takes_no_room():
    points, cells = lattice(4, jitter=0.2)
    near = Mesh(4.0 * points, (CellBlock("tetra", cells, np.zeros(len(cells))),))
    best = gmsnet.smooth(near).judged.after
    result = gmsnet.smooth(rounded(replace(near, points=near.points * SIDE + FAR)))
    assert result.judged.after.shape_min > result.judged.before.shape_min + 0.1
    assert result.judged.after.shape_min > best.shape_min - 0.02
    assert result.after.inverted == 0


@pytest.mark.parametrize("kind", ["quad", "triangle"])
@pytest.mark.parametrize("method", ["auto", "barrier"])
def test_text_with_more_digits_is_valid_however_it_is_read(kind, method):
    mesh = replace(grid(kind), single=True)
    assert not mesh.exact
    result = gmsnet.smooth(mesh, method)
    for read in (np.float64, np.float32):
        points = result.points.astype(read).astype(float)
        assert is_valid(mesh.points.astype(read).astype(float), mesh)
        assert is_valid(points, mesh)


def test_whether_coordinates_are_exact_is_found_anew_for_other_points():
    mesh = replace(grid("quad"), single=True)
    assert not mesh.exact
    assert mesh.with_points(mesh.points.astype(np.float32).astype(float)).exact
    assert grid("quad").exact  # of double precision


def test_ranks_agree_on_how_exactly_coordinates_are_known():
    near = block(3, 3, 3, jitter=0.25)
    points = (near.points * SIDE + FAR).astype(np.float32).astype(float)
    points[-1] += 1e-4  # not a number of single precision, and of one rank alone
    mesh = replace(near, points=points, single=True)
    parts = parts_at_random(mesh, 3, np.random.default_rng(0), "strips")
    found, _ = spread(mesh, SmoothOptions(threads=1), parts, 3)
    assert same(found, gmsnet.smooth(mesh, threads=1).points)

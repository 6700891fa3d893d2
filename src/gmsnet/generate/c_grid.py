"""Rows of stretched cells around an airfoil with a sharp tail, and on along both sides of its wake: a C-grid."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from gmsnet.errors import InputError
from gmsnet.generate.arguments import at_least, one_of, whole_number
from gmsnet.generate.layered import THICKNESS
from gmsnet.generate.marked import marked
from gmsnet.mesh.mesh import Mesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

REACH = 4.0  # chords from the nose to the outlet
SAMPLES = 4000  # of the airfoil, between which a spline is laid
CELLS = ("triangle", "quad")


def c_grid_mesh(layers: int = 20, aspect: float = 1000.0, around: int = 120, *, cells: str = "quad") -> Mesh:
    """Cells around a Joukowski airfoil of chord 1 with a cusp for a tail, its nose at the origin.

    layers: rows of cells at the wall. aspect: the ratio of the sides of those at the wall, as quads; from row to row it
    falls by one factor, down to 1 beyond the last. around: nodes on the wall, an even number. cells: "quad", or
    "triangle", which halves the quads.

    The root of z less a point within the nose folds airfoil and wake out to a nearly straight line. Rows of nodes are
    parallel to that line there, at places evenly spaced along it; the map keeps angles. The same arguments give the
    same mesh. Markers: "airfoil" and "farfield"; the nodes of the wake lie inside the domain.

    Raises InputError for less than one layer, an aspect below 1 or not finite, less than 20 nodes or an odd number of
    them, and for other cells.
    """
    layers, around = whole_number(layers, "layers", 1), whole_number(around, "around", 20)
    if around % 2:
        raise InputError(f"the nodes around an airfoil must be an even number, got {around}")
    aspect = at_least(aspect, "the aspect", 1.0)
    one_of(cells, "cells", CELLS)
    rows, wake = _rows(layers, aspect, around)
    number = np.arange(rows.size // 2).reshape(len(rows), -1)
    number[0, : -wake - 2 : -1] = number[0, : wake + 1]  # the two sides of the wake are one row of nodes
    kept, where = np.unique(number, return_inverse=True)
    number = where.reshape(len(rows), -1)
    quads = np.stack([number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]], axis=-1).reshape(-1, 4)
    wall = number[0, wake : number.shape[1] - wake]
    far = np.concatenate([number[:, -1], number[-1, -2::-1], number[-2::-1, 0]])
    edges = np.concatenate([np.column_stack([line[:-1], line[1:]]) for line in (wall, far)])
    side = np.repeat([0, 1], [len(wall) - 1, len(far) - 1])
    faces = {"quad": quads} if cells == "quad" else {"triangle": np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]])}
    return marked(rows.reshape(-1, 2)[kept], faces, edges, side, ("airfoil", "farfield"))


def _rows(layers: int, aspect: float, around: int) -> tuple[Floats, int]:
    """(rows, columns, 2) the nodes of the rows, from the outlet below the wake around the nose to that above it.

    And how many of the first row, from either end, are of the wake alone.
    """
    turn = np.linspace(2.0 * np.pi, 0.0, SAMPLES)[1:-1]
    zeta = -THICKNESS + (1.0 + THICKNESS) * np.exp(1j * turn)
    z = zeta + 1.0 / zeta
    z = (z - z.real.min()) / (2.0 - z.real.min())
    # The nose is a parabola x = c·y², whose focus lies 1/(4c) behind it.
    nose = abs(turn - np.pi) < 0.02
    focus = 0.25 / float(np.polyfit(z[nose].imag, z[nose].real, 2)[0])
    end = float(np.sqrt(1.0 - focus))
    folded = np.sqrt(z - focus)
    folded = np.where(folded.imag < 0.0, -folded, folded)
    height = CubicSpline(np.concatenate([[-end], folded.real, [end]]), np.concatenate([[0.0], folded.imag, [0.0]]))
    step = 2.0 * end / around
    wake = max(1, round((np.sqrt(REACH - focus) - end) / step))
    along = step * np.arange(-around // 2 - wake, around // 2 + wake + 1)
    wall = np.where(np.abs(along) < end * (1.0 - 1e-9), height(along), 0.0)
    more = max(1, round((np.sqrt(REACH - focus)) / step))
    away = np.cumsum(np.concatenate([[0.0], aspect ** (np.arange(layers) / layers - 1.0), np.ones(more)]))
    place = (along + 1j * (wall + step * away[:, None])) ** 2 + focus
    return np.stack([place.real, place.imag], axis=-1), wake

"""Measures of volume cells by the simplices at their corners: mean ratio, Verdict's scaled Jacobian, dihedral angles.

With the spokes A of a corner and its ideal W, T = A W⁻¹ has the mean ratio η = 3 det(T)^(2/3)/‖T‖²_F with the sign of
det(T) (Knupp, SIAM J. Sci. Comput. 23, 2001). That of a cell is its worst corner's; of a tetrahedron all are alike.

The scaled Jacobian det/(|a||b||c|) is Verdict's: of a hexahedron the least of its corners' and of its axes'; of a wedge
the least corner's times 2/√3; of a tetrahedron √2 times that of the largest product; of a pyramid √2 times the least
of the four tetrahedra that its base's diagonals make. Dihedral angles at a corner lie between its three planes.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.kind import CellKind
from gmsnet.kernels.simplex.tetra_measures import COLUMNS, per_tetrahedron

Floats = NDArray[np.float64]

TINY = 1e-300
AT_ONCE = 1 << 16  # cells whose spokes are in memory at a time
HALVES = ((0, 1, 2, 4), (0, 2, 3, 4), (0, 1, 3, 4), (1, 2, 3, 4))  # the tetrahedra of a pyramid
AXES = ((1, 2, 6, 5, 0, 3, 7, 4), (3, 2, 6, 7, 0, 1, 5, 4), (4, 5, 6, 7, 0, 1, 2, 3))  # ends and starts in a hexahedron


def of_corners(points: Floats, nodes: NDArray[np.int32], kind: CellKind, orientation: NDArray[np.int8]) -> Floats:
    """(4, C) smallest and largest dihedral angle in degrees, η and scaled Jacobian of cells (C, n) of one kind."""
    if kind.corners == 4:  # all its corners are alike
        columns = np.empty((COLUMNS, len(nodes)))
        per_tetrahedron(points, np.ascontiguousarray(nodes[:, :4], dtype=np.int32), orientation, 0, len(nodes), columns)
        return columns[:4]
    found = np.empty((4, len(nodes)))
    for first in range(0, len(nodes), AT_ONCE):
        some = slice(first, first + AT_ONCE)
        found[:, some] = _of_some(points[nodes[some, : kind.corners], :3], kind, orientation[some].astype(np.float64))
    return found


def eta_at_corners(points: Floats, nodes: NDArray[np.int32], kind: CellKind, orientation: NDArray[np.int8]) -> Floats:
    """(S, C) η at each corner of cells (C, n) of one kind."""
    found, sense = np.empty((len(kind.simplices), len(nodes))), orientation.astype(np.float64)
    for first in range(0, len(nodes), AT_ONCE):
        some = slice(first, first + AT_ONCE)
        at = points[nodes[some, : kind.corners], :3]
        for k, (simplex, inverse) in enumerate(zip(kind.simplices, kind.ideal, strict=True)):
            spokes = _spokes(at, simplex)
            found[k, some] = _mean_ratio(spokes, sense[some] * _determinant(spokes), np.array(inverse))
    return found


def straight_size(points: Floats, nodes: NDArray[np.int32], kind: CellKind) -> Floats:
    """(C,) the mean of the determinants at the corners of cells with straight edges."""
    total = np.zeros(len(nodes))
    for first in range(0, len(nodes), AT_ONCE):
        some = slice(first, first + AT_ONCE)
        at = points[nodes[some, : kind.corners], :3]
        total[some] = np.mean([_determinant(_spokes(at, simplex)) for simplex in kind.simplices], axis=0)
    return total


def _of_some(at: Floats, kind: CellKind, orientation: Floats) -> Floats:
    """The same of the corners (C, corners, 3) of some."""
    low, high = np.full(len(at), np.inf), np.full(len(at), -np.inf)
    shape, scaled = low.copy(), low.copy()
    for simplex, inverse in zip(kind.simplices, kind.ideal, strict=True):
        spokes = _spokes(at, simplex)
        determinant = orientation * _determinant(spokes)
        for angle in _dihedral(spokes, determinant):
            low, high = np.minimum(low, angle), np.maximum(high, angle)
        shape = np.minimum(shape, _mean_ratio(spokes, determinant, np.array(inverse)))
        scaled = np.minimum(scaled, determinant / np.maximum(_product(spokes), TINY))
    return np.stack([low, high, shape, _scaled_jacobian(at, kind, orientation, scaled)])


def _scaled_jacobian(at: Floats, kind: CellKind, orientation: Floats, of_corner: Floats) -> Floats:
    """By Verdict's rule for the kind. of_corner: (C,) the least det/(|a||b||c|) over the corners."""
    if kind.corners == 6:
        of_wedge: Floats = of_corner * (2.0 / np.sqrt(3.0))
        return of_wedge
    if kind.corners == 8:
        ends = [at[:, axis[:4]].sum(axis=1) - at[:, axis[4:]].sum(axis=1) for axis in AXES]
        axes = np.stack(ends, axis=1)
        of_axes: Floats = orientation * _determinant(axes) / np.maximum(_product(axes), TINY)
        return np.minimum(of_corner, of_axes)
    tetrahedra = HALVES if kind.corners == 5 else ((0, 1, 2, 3),)
    least = np.full(len(at), np.inf)
    for nodes in tetrahedra:
        turns = [(nodes[k], *(n for n in nodes if n != nodes[k])) for k in range(4)]
        product = np.max([_product(_spokes(at, turn)) for turn in turns], axis=0)
        determinant = orientation * _determinant(_spokes(at, nodes))
        least = np.minimum(least, np.sqrt(2.0) * determinant / np.maximum(product, TINY))
    return np.sqrt(2.0) * least if kind.corners == 5 else least


def _spokes(at: Floats, simplex: Sequence[int]) -> Floats:
    """(C, 3, 3) from the first node of a simplex to the others, one a row."""
    spokes: Floats = at[:, list(simplex[1:])] - at[:, [simplex[0]]]
    return spokes


def _determinant(spokes: Floats) -> Floats:
    found: Floats = np.einsum("ij,ij->i", spokes[:, 0], np.cross(spokes[:, 1], spokes[:, 2]))
    return found


def _product(spokes: Floats) -> Floats:
    """(C,) of the lengths of the three."""
    found: Floats = np.sqrt((spokes * spokes).sum(axis=2)).prod(axis=1)
    return found


def _mean_ratio(spokes: Floats, determinant: Floats, inverse: Floats) -> Floats:
    deviation = np.einsum("cki,kj->cij", spokes, inverse)  # spokes are rows: A is their transpose
    value = np.cbrt(determinant * np.linalg.det(inverse))
    norm = (deviation * deviation).sum(axis=(1, 2))
    ratio: Floats = np.sign(value) * 3.0 * value * value / np.maximum(norm, TINY)
    return ratio


def _dihedral(spokes: Floats, determinant: Floats) -> list[Floats]:
    """The three angles at a corner in degrees, of the geometric simplex."""
    angles = []
    for k in range(3):
        edge, one, other = spokes[:, k], spokes[:, (k + 1) % 3], spokes[:, (k + 2) % 3]
        length = np.sqrt((edge * edge).sum(axis=1))
        across = np.einsum("ij,ij->i", np.cross(edge, one), np.cross(edge, other))
        angles.append(np.degrees(np.arctan2(length * np.abs(determinant), across)))
    return angles

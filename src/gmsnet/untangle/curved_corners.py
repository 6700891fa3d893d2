"""Second-order cells that no motion makes valid: somewhere det J depends on held nodes alone, and is not positive.

At a corner J has the tangents of the edges there, and that of an edge depends on its nodes alone. On an edge of a
volume cell J has derivatives along the two facets beside it. So where both are held, det J is what it is.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.jacobian import derivatives_on_edges, has_form
from gmsnet.cells.table import CELLS

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

PARTS = 8  # of an edge of a volume cell: at their ends det J is looked at
ROUNDING = 1e-14  # of the product of the lengths of the derivatives: no lower determinant can be certified


def bad_for_good(
    points: Floats, cells: NDArray[np.int32], kinds: NDArray[np.integer], names: tuple[str, ...], free: Flags
) -> Flags:
    """(C,) which cells are so. cells: (C, W) of positive sense, −1 past the last node.

    points: (N, 2 or more). kinds: (C,) numbers of ``names``. free: (N,).
    """
    found = np.zeros(len(cells), dtype=bool)
    for number, name in enumerate(names):
        rows = np.flatnonzero(kinds == number)
        if len(rows):
            nodes = cells[rows, : CELLS[name].nodes]
            may = free[nodes]
            for weights in _derivatives(name):
                some = np.flatnonzero(~may[:, (np.abs(weights) > ROUNDING).any(axis=0)].any(axis=1))
                found[rows[some]] |= _not_positive(points[:, : len(weights)], nodes[some], weights)
    return found


def _not_positive(points: Floats, nodes: NDArray[np.int32], weights: Floats) -> Flags:
    matrix = np.einsum("dn,cnk->cdk", weights, points[nodes] - points[nodes[:, :1]])
    size = np.linalg.norm(matrix, axis=2).prod(axis=1)
    below: Flags = np.linalg.det(matrix) <= ROUNDING * size
    return below


@cache
def _derivatives(name: str) -> Floats:
    """(P, D, nodes) the weights of a cell's nodes in its derivatives at some places, corners among them."""
    kind = CELLS[name]
    if has_form(name):
        return np.unique(derivatives_on_edges(name, PARTS), axis=0)
    found = np.zeros((len(kind.simplices), kind.dimension, kind.nodes or 0))
    middle = {frozenset(edge[:2]): edge[2:] for edge in kind.edges}
    for at, (corner, *ends) in zip(found, kind.simplices, strict=True):
        for row, end in zip(at, ends, strict=True):
            between = list(middle[frozenset((corner, end))])
            row[[corner, end]] = (-3.0, -1.0) if between else (-1.0, 1.0)
            row[between] = 4.0
    return found

"""All nodes of a patch in the means of their neighbours at once: a sparse system, not a thousand Laplacian sweeps.

In a convex rim that makes every cell positive (W. T. Tutte, How to draw a graph, Proceedings of the London Mathematical
Society 13, 1963); elsewhere it is a start from which little is left to mend, however wild the nodes were thrown.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.sparse
import scipy.sparse.linalg
from numpy.typing import NDArray

from gmsnet.untangle.patch import Floats, Patch


def harmonic(points: Floats, patch: Patch) -> Floats:
    """The points (m, 2) of a patch with the moved ones in the means of their neighbours, by a direct solver."""
    count, (start, around, pattern, patterns) = patch.count, patch.stars
    rows = np.repeat(np.arange(count), np.diff(start))
    if pattern is None or patterns is None:
        weights, degree = np.ones(len(rows)), np.diff(start).astype(float)
    else:  # a node is joined by edges, and not to what is diagonal to it
        weights, degree = patterns.neighbour[patterns.row[pattern[rows]] + within(start)], patterns.neighbours[pattern]
    joins = scipy.sparse.csc_matrix((weights, (rows, around)), shape=(count, len(points)))
    joins.eliminate_zeros()
    matrix = scipy.sparse.diags_array(degree, format="csc") - joins[:, :count]
    out = points.copy()
    out[:count] = solver_of(matrix)(joins[:, count:] @ points[count:])
    return out


def solver_of(matrix: scipy.sparse.csc_array) -> Callable[[Floats], Floats]:
    """Solves systems with a symmetric, positive definite matrix (n, n) for right-hand sides (n,) or (n, k)."""
    factors = scipy.sparse.linalg.splu(
        scipy.sparse.csc_matrix(matrix), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )  # fmt: skip
    solve: Callable[[Floats], Floats] = factors.solve
    return solve


def within(start: NDArray[np.integer[Any]]) -> NDArray[np.intp]:
    """The place of each entry in its row, of CSR arrays whose rows begin at ``start``."""
    return np.arange(start[-1]) - np.repeat(start[:-1], np.diff(start))

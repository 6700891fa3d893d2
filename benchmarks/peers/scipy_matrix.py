"""A Laplacian sweep as the product of a sparse matrix with the coordinates; also L, the unit of all times."""

from __future__ import annotations

import numpy as np
import scipy.sparse
from scipy.sparse.csgraph import reverse_cuthill_mckee

from peers.peer import Plane


def neighbours(plane: Plane) -> scipy.sparse.csr_matrix:
    """Row i has a one for each neighbour of node i, and is empty where the node is held."""
    tail, head = plane.edges
    free = ~plane.held[tail]
    tail, head = tail[free], head[free]
    return scipy.sparse.csr_matrix((np.ones(len(tail)), (tail, head)), shape=2 * (len(plane.points),))


def averaging(plane: Plane) -> scipy.sparse.csr_matrix:
    """Row i averages the neighbours of node i where it is free, and keeps it where it is held."""
    matrix = neighbours(plane)
    degree = np.diff(matrix.indptr)
    matrix.data = np.repeat(1.0 / np.maximum(degree, 1), degree)
    return (matrix + scipy.sparse.diags(plane.held.astype(np.float64), format="csr")).tocsr()


def in_good_order(plane: Plane) -> Plane:
    """The mesh with its nodes in reverse Cuthill–McKee order."""
    tail, head = plane.edges
    count = len(plane.points)
    graph = scipy.sparse.csr_matrix((np.ones(len(tail)), (tail, head)), shape=(count, count))
    order = reverse_cuthill_mckee(graph)
    place = np.empty(count, dtype=np.int64)
    place[order] = np.arange(count)
    return Plane(plane.points[order], place[plane.cells], place[plane.quads])


class Laplacian:
    """In the order of the input: bringing the nodes into a better one takes longer than 50 sweeps gain by it."""

    def __init__(self, plane: Plane) -> None:
        self.matrix, self.at = averaging(plane), plane.points

    def smooth(self, effort: int) -> None:
        for _ in range(effort):
            self.at = self.matrix @ self.at

    def points(self) -> np.ndarray:
        return self.at

    def cells(self) -> None:
        return None

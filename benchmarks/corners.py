"""A planar mesh of triangles and quads as simplices, and what is compared of it: least and mean 1/q, invalid cells.

A triangle is one simplex, a quad four, one at each corner. Nothing here asks gmsnet which nodes it moves or how it
measures, so that both can be checked by it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse
from barrier import KAPPA, Problem
from scipy.sparse.csgraph import connected_components, reverse_cuthill_mckee

from gmsnet.mesh.mesh import Mesh
from gmsnet.topology.ordering import planar_points


@dataclass(frozen=True, eq=False)
class Corners:
    """mesh: whose faces are triangles and quads. cell: (S,) the face of each simplex. problem: see ``Problem``."""

    mesh: Mesh
    cell: np.ndarray
    problem: Problem

    @classmethod
    def of(cls, mesh: Mesh) -> Corners:
        """Raises ValueError for other kinds of cells, and for a mesh out of plane."""
        if mesh.plane is None or any(
            block.kind not in ("triangle", "quad") for block in mesh.cells if block.dimension > 1
        ):
            raise ValueError("only planar meshes of triangles and quads have corners to be optimised")
        blocks = [block for block in mesh.cells if block.dimension == 2]
        size = np.concatenate([np.full(len(block.nodes), block.nodes.shape[1]) for block in blocks])
        after = np.concatenate([np.roll(block.nodes, -1, axis=1).ravel() for block in blocks])
        node = np.concatenate([block.nodes.ravel() for block in blocks])
        before = np.concatenate([np.roll(block.nodes, 1, axis=1).ravel() for block in blocks])
        owner = np.repeat(np.arange(len(size)), size)
        points = planar_points(mesh)
        turned = ~wound(points, owner, node, after)[owner]
        after[turned], before[turned] = before[turned], after[turned]
        last = np.cumsum(size) - 1
        wanted = (size[owner] == 4) | (np.arange(len(owner)) == last[owner])  # of a triangle, any one of its corners
        simplices = np.column_stack([node, after, before])[wanted].astype(np.int32)
        regions = np.concatenate([block.regions for block in blocks])
        free = ~held(mesh, owner, node, after, regions)
        return cls(mesh, owner[wanted], Problem(simplices, free, (size[owner] == 4)[wanted]))

    def written(self, planar: np.ndarray) -> np.ndarray:
        """(N, dim) points of the mesh from planar ones, those that are held as they are."""
        points, free = self.mesh.points.copy(), self.problem.free
        points[np.ix_(free, self.mesh.plane)] = np.ldexp(planar[free], self.mesh.exponent)
        return points

    def figures(self, points: np.ndarray) -> dict[str, float]:
        """Of points (N, dim): min and mean 1/q over the cells with a free node, all_min and all_mean over all cells.

        1/q of a cell is the least of its corners', with the sign of their areas. invalid: cells with a corner of no
        positive area.
        """
        planar, (corner, after, before) = planar_points(self.mesh.with_points(points)), self.problem.triangles.T
        (ax, ay), (bx, by) = (planar[after] - planar[corner]).T, (planar[before] - planar[corner]).T
        right = self.problem.right
        between = np.where(right, 0.0, ax * bx + ay * by)
        numerator = np.where(right, 0.5, KAPPA) * (ax * ax + ay * ay + bx * bx + by * by - between)
        simplex = (ax * by - ay * bx) / np.where(numerator > 0.0, numerator, 1.0)
        shape, moves = np.full(self.cell[-1] + 1, np.inf), np.zeros(self.cell[-1] + 1, dtype=bool)
        np.minimum.at(shape, self.cell, simplex)
        np.logical_or.at(moves, self.cell, self.problem.free[self.problem.triangles].any(axis=1))
        some = shape[moves] if moves.any() else shape
        return {
            "min": float(some.min()),
            "mean": float(some.mean()),
            "all_min": float(shape.min()),
            "all_mean": float(shape.mean()),
            "invalid": int((shape <= 0.0).sum()),
        }

    @cached_property
    def edges(self) -> scipy.sparse.csr_matrix:
        """(N, N): a one where two nodes share an edge."""
        corner, after, before = self.problem.triangles.astype(np.int64).T
        third = ~self.problem.right  # of a triangle; a quad's diagonal is no edge
        one = np.concatenate([corner, corner, after[third]])
        two = np.concatenate([after, before, before[third]])
        graph = scipy.sparse.coo_array((np.ones(2 * len(one)), (np.append(one, two), np.append(two, one))))
        matrix = scipy.sparse.csr_matrix(graph, shape=2 * self.problem.free.shape)
        matrix.sum_duplicates()
        matrix.data[:] = 1.0
        return matrix

    @cached_property
    def order(self) -> np.ndarray:
        """(N,) the nodes in reverse Cuthill–McKee order."""
        return reverse_cuthill_mckee(self.edges, symmetric_mode=True)

    @cached_property
    def averaging(self) -> scipy.sparse.csr_matrix:
        """Row i averages the nodes that share an edge with node i where it is free, and keeps it where it is held.

        The nodes are in ``order``.
        """
        free = self.problem.free
        mean = scipy.sparse.diags(free / np.maximum(np.diff(self.edges.indptr), 1)) @ self.edges
        matrix = scipy.sparse.csr_matrix(mean + scipy.sparse.diags((~free).astype(float)))
        matrix.eliminate_zeros()
        return matrix[self.order][:, self.order]


def wound(points: np.ndarray, owner: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """(F,) bool: which faces are counter-clockwise, from their edges start → end (each E,) and the owner (E,) of each.

    Neighbours are wound alike, and in each connected part the larger area is counted as positive.
    """
    count = int(owner[-1]) + 1
    one, two = twice(start, end, len(points))
    against = start[one] == start[two]  # they go through their edge in the same direction
    # Each face is there twice, as it is and turned; what is joined is wound alike.
    rows = np.concatenate([owner[one], owner[one] + count])
    columns = np.concatenate([owner[two] + count * against, owner[two] + count * ~against])
    graph = scipy.sparse.coo_array((np.ones(len(rows)), (rows, columns)), shape=(2 * count, 2 * count))
    _, label = connected_components(graph, directed=False)
    (x0, y0), (x1, y1) = (points[start] - points[start[0]]).T, (points[end] - points[start[0]]).T
    area = np.bincount(owner, x0 * y1 - x1 * y0, count)
    total = np.bincount(label, np.concatenate([area, -area]))
    return total[label[:count]] > 0.0


def held(mesh: Mesh, owner: np.ndarray, start: np.ndarray, end: np.ndarray, regions: np.ndarray) -> np.ndarray:
    """(N,) bool: nodes of the boundary, of interfaces, of edges of three faces, of lines and vertices, and of no face.

    start → end: the edges of the faces (each E,); owner: of each (E,). regions: of the faces.
    """
    inner = np.zeros(len(owner), dtype=bool)
    one, two = twice(start, end, len(mesh.points))
    same = regions[owner[one]] == regions[owner[two]]
    inner[one[same]] = inner[two[same]] = True
    found = np.ones(len(mesh.points), dtype=bool)
    found[start] = False
    found[start[~inner]] = found[end[~inner]] = True
    for block in mesh.cells:
        if block.dimension < 2:
            found[block.nodes] = True
    return found


def twice(start: np.ndarray, end: np.ndarray, nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """The places (each k,) of the first and the second of two edges with the same ends, where there are just two."""
    keys = np.minimum(start, end).astype(np.int64) * nodes + np.maximum(start, end)
    order = np.argsort(keys, kind="stable")
    _, first, count = np.unique(keys[order], return_index=True, return_counts=True)
    return order[first[count == 2]], order[first[count == 2] + 1]

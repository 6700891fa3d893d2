"""Good triangle meshes of a domain bounded by curves, for a size function: the nodes of a Delaunay triangulation push
and pull one another until all edges have the wanted length.

Sources: F. Bossen, P. Heckbert, "A pliant method for anisotropic mesh generation", 5th International Meshing
Roundtable, 1996 (the force, nodes inserted and deleted on the way); P.-O. Persson, G. Strang, "A simple mesh generator
in MATLAB", SIAM Review 46(2), 2004 (triangulating anew after each step).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import InputError
from gmsnet.generate.curves import Boundary, Curve, Size, boundary
from gmsnet.generate.delaunay import Triangulation, labelled, triangulate, unique_edges
from gmsnet.generate.outline import inside
from gmsnet.mesh.mesh import Mesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Lengths are in wanted lengths, times in steps.
LONG, SHORT = 1.35, 0.7  # an edge beyond these gets a node in its middle, or loses one of its ends
STRENGTH, FINE_STRENGTH = 0.2, 0.1  # of the force; above 0.25 the nodes of a perfect mesh begin to swing
STEPS, FINE_STEPS = 8, 60  # between changes of the nodes; at the end
MOST_ROUNDS = 100
LEAST_DEGREE = 5  # of an inner node: with four triangles or fewer around it, one of them has an angle of 90° or more


def good_mesh(rings: Sequence[Sequence[Curve]], size: Size | float) -> Mesh:
    """A triangle mesh whose edges are about as long as ``size``.

    rings: curves end to end around the domain, then around each of its holes. size: wanted length of edges, or a
    function from points (n × 2) to it (n,); where it varies, it should do so by less than a fifth of the way.

    Returns counter-clockwise triangles of the region "domain", and the boundary as line cells by the curves' markers.
    The same arguments give the same mesh: nothing is drawn at random. No inner node has less than five triangles
    around it, unless nodes that close to the boundary cannot be spared.

    Raises InputError for sizes that are not positive and for rings that are not closed, cross, or are not nested.
    """
    wanted = _checked(size)
    outline = boundary(rings, wanted)
    relaxation = Relaxation(outline, wanted)
    relaxation.populate()
    relaxation.regularise()
    relaxation.relax(FINE_STEPS, FINE_STRENGTH)
    return labelled(relaxation.triangulation(), outline.markers)


def _checked(size: Size | float) -> Size:
    """The size function, checked at each call."""

    def wanted(points: Floats) -> Floats:
        values = size(points) if callable(size) else np.full(len(points), float(size))
        if np.shape(values) != (len(points),) or not (np.isfinite(values) & (values > 0)).all():
            raise InputError("the size of edges must be a positive number at every point")
        return np.asarray(values, dtype=np.float64)

    return wanted


class Relaxation:
    """Inner nodes on their way to good places; the nodes of the boundary stand still."""

    outline: Boundary
    size: Size
    inner: NDArray[np.float64]

    def __init__(self, outline: Boundary, size: Size) -> None:
        self.outline, self.size = outline, size
        self.inner = np.empty((0, 2))

    def triangulation(self) -> Triangulation:
        """The nodes as they are, those of the boundary first."""
        return triangulate(self.outline.points, self.outline.segments, self.outline.side, self.inner)

    def relax(self, steps: int, strength: float) -> None:
        """Moves each node along the sum of its edges' forces, f(l) = (1 − l⁴)·exp(−l⁴) of an edge of the length l."""
        start, end = (self.outline.points[self.outline.segments[:, k]] for k in range(2))
        for _ in range(steps):
            mesh = self.triangulation()
            edges, along, wanted = self._measured(mesh)
            length = np.linalg.norm(along, axis=1)
            fourth = (length / wanted) ** 4
            force = (strength * wanted * (1.0 - fourth) * np.exp(-fourth) / length)[:, None] * along
            shift = np.zeros_like(mesh.points)
            np.add.at(shift, edges[:, 1], force)
            np.add.at(shift, edges[:, 0], -force)
            moved = self.inner + shift[len(mesh.points) - len(self.inner) :]
            self.inner = moved[inside(moved, start, end)]

    def populate(self) -> None:
        """Inserts and deletes nodes, and relaxes, until no edge is too long or too short."""
        for _ in range(MOST_ROUNDS):
            mesh = self.triangulation()
            edges, along, wanted = self._measured(mesh)
            length = np.linalg.norm(along, axis=1) / wanted
            outer = len(mesh.points) - len(self.inner)
            split = np.flatnonzero((length > LONG) & ~on_boundary(edges, mesh))
            split = apart(edges, split[np.argsort(-length[split], kind="stable")], len(mesh.points))
            merge = np.flatnonzero((length < SHORT) & (edges[:, 1] >= outer))  # the second end has the larger number
            merge = apart(edges, merge[np.argsort(length[merge], kind="stable")], len(mesh.points))
            if not (split.size or merge.size):
                return
            kept = np.delete(self.inner, edges[merge, 1] - outer, axis=0)
            self.inner = np.concatenate([kept, mesh.points[edges[split]].mean(axis=1)])
            self.relax(STEPS, STRENGTH)

    def regularise(self) -> None:
        """Deletes inner nodes of too small a degree, and relaxes, until there are none."""
        for _ in range(MOST_ROUNDS):
            mesh = self.triangulation()
            edges, _, _ = self._measured(mesh)
            outer = len(mesh.points) - len(self.inner)
            degree = np.bincount(edges.ravel(), minlength=len(mesh.points))
            few = np.flatnonzero(degree[outer:] < LEAST_DEGREE)
            if not few.size:
                return
            self.inner = np.delete(self.inner, few[:1], axis=0)
            self.relax(2 * STEPS, STRENGTH)

    def _measured(self, mesh: Triangulation) -> tuple[Ints, Floats, Floats]:
        """The edges (E × 2), each from its first node to its second (E × 2), and the length that each should have."""
        edges = unique_edges(mesh.triangles)
        start, end = mesh.points[edges[:, 0]], mesh.points[edges[:, 1]]
        return edges, end - start, self.size((start + end) / 2)


def on_boundary(edges: Ints, mesh: Triangulation) -> NDArray[np.bool_]:
    """Which edges (E × 2, the smaller number first) are segments of the boundary."""
    segments = np.sort(mesh.segments, axis=1) @ [len(mesh.points), 1]
    return np.isin(edges @ [len(mesh.points), 1], segments)


def apart(edges: Ints, candidates: Ints, nodes: int) -> Ints:
    """The candidates among the edges, in their order, without those that share a node with one before."""
    taken = np.zeros(nodes, dtype=bool)
    chosen = []
    for k in candidates.tolist():
        if not taken[edges[k]].any():
            taken[edges[k]] = True
            chosen.append(k)
    return np.array(chosen, dtype=np.int64)

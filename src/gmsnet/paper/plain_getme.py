"""GETMe in plain Python, one element at a time: the twin of kernels/methods/getme.py, and what the paper's timing of
it times.

Vartziotis, Wipper: The GETMe Mesh Smoothing Framework (2018), sections 6.1.2 (simultaneous) and 6.1.3 (sequential).
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterable

from gmsnet.paper.plain import PlainMesh, Point, area, edges, shape, truncated

Triangle = tuple[Point, Point, Point]
Element = tuple[int, int, int]

INVALID, SUCCESS, REPEATED = 1e-4, 1e-3, 1e-5  # penalties: added, taken off (down to 0 at most), and added


def transformed(z: Triangle, theta: float, lambda_: float, rho: float) -> Triangle:
    """A counter-clockwise triangle made more regular, scaled to its old perimeter and taken by the share rho.

    z″_k = z_k + c₁·J(z_{k+1} − z_{k−1}) + c₂·(z_{k−1} + z_{k+1} − 2·z_k), J(x, y) = (y, −x).
    """
    c1 = (1.0 - lambda_) * math.tan(theta)
    c2 = lambda_ * (1.0 - lambda_) - c1**2
    new = []
    for k in range(3):
        here, after, before = z[k], z[(k + 1) % 3], z[k - 1]
        new.append(
            (
                here[0] + c1 * (after[1] - before[1]) + c2 * (before[0] + after[0] - 2.0 * here[0]),
                here[1] - c1 * (after[0] - before[0]) + c2 * (before[1] + after[1] - 2.0 * here[1]),
            )
        )
    gx, gy = sum(p[0] for p in z) / 3.0, sum(p[1] for p in z) / 3.0
    scale = perimeter(z) / perimeter(new) if perimeter(new) > 0.0 else 0.0
    scaled = [(gx + scale * (p[0] - gx), gy + scale * (p[1] - gy)) for p in new]
    a, b, c = [
        ((1.0 - rho) * p[0] + rho * q[0], (1.0 - rho) * p[1] + rho * q[1]) for p, q in zip(z, scaled, strict=True)
    ]
    return a, b, c


def perimeter(z: Iterable[Point]) -> float:
    """The length of a closed line."""
    return sum(math.dist(a, b) for a, b in edges(list(z)))


class PlainGetme:
    """Sequential GETMe: at each step the element with the least 1/q + penalty is transformed.

    Elements without a free node never take part. success: what a transformation takes off its element's penalty.
    shapes, penalties: by element. The heap keeps outdated entries; one counts if its key is what the element's key is
    now.
    """

    mesh: PlainMesh
    parameters: tuple[float, float, float]
    success: float
    elements: list[Element]
    shapes: list[float]
    penalties: list[float]
    heap: list[tuple[float, int]]
    last: int

    def __init__(
        self,
        mesh: PlainMesh,
        theta: float = math.pi / 3.0,
        lambda_: float = 0.0,
        rho: float = 1.0,
        *,
        success: float = SUCCESS,
    ) -> None:
        self.mesh, self.parameters, self.success = mesh, (theta, lambda_, rho), success
        self.elements = elements_of(mesh)
        self.around: dict[int, list[int]] = {node: [] for node in mesh.free}
        for e, element in enumerate(self.elements):
            for node in element:
                if node in self.around:
                    self.around[node].append(e)
        self.shapes = [shape(*self.corners(e)) for e in range(len(self.elements))]
        self.penalties = [0.0] * len(self.elements)
        self.heap = [(self.key(e), e) for e in range(len(self.elements))]
        heapq.heapify(self.heap)
        self.last = -1

    def corners(self, e: int) -> Triangle:
        """The corners of an element as they stand."""
        a, b, c = self.elements[e]
        return self.mesh.points[a], self.mesh.points[b], self.mesh.points[c]

    def key(self, e: int) -> float:
        """What the elements are ordered by: 1/q + penalty.

        Inverted elements, which the book does not know, come first, but by no more than one penalty.
        """
        return (self.shapes[e] if self.shapes[e] > 0.0 else INVALID * self.shapes[e]) + self.penalties[e]

    def worst(self) -> int:
        """The element with the least key, the first of several."""
        while self.heap[0][0] != self.key(self.heap[0][1]):
            heapq.heappop(self.heap)
        return self.heap[0][1]

    def step(self) -> int:
        """Transforms the worst element; puts it back if that breaks a triangle. Returns how many nodes that moves."""
        e = self.worst()
        if e == self.last:
            self.penalties[e] += REPEATED
        self.last = e
        nodes = [node for node in self.elements[e] if node in self.around]
        affected = sorted({f for node in nodes for f in self.around[node]})
        old, areas = self.corners(e), [area(*self.corners(f)) for f in affected]
        for node, place in zip(self.elements[e], transformed(old, *self.parameters), strict=True):
            if node in self.around:
                self.mesh.points[node] = place
        if any(breaks(before, area(*self.corners(f))) for before, f in zip(areas, affected, strict=True)):
            for node, place in zip(self.elements[e], old, strict=True):
                self.mesh.points[node] = place
            self.penalties[e] += INVALID
            affected = [e]
        else:
            self.penalties[e] = max(0.0, self.penalties[e] - self.success)
        for f in affected:
            self.shapes[f] = shape(*self.corners(f))
            heapq.heappush(self.heap, (self.key(f), f))
        return len(nodes)


def breaks(before: float, after: float) -> bool:
    """Is an area neither positive, nor negative and nearer to 0 than before?"""
    return not (after > 0.0 or before < after < 0.0)


def elements_of(mesh: PlainMesh) -> list[Element]:
    """The triangles that have a free node, counter-clockwise, each from its lowest node on, in ascending order."""
    elements = set()
    for node, ring in mesh.rings.items():
        for a, b in zip(ring, ring[1:] + ring[:1], strict=True):
            at = (node, a, b).index(min(node, a, b))
            corners = (node, a, b, node, a)
            elements.add((corners[at], corners[at + 1], corners[at + 2]))
    return sorted(elements)


def simultaneous(
    mesh: PlainMesh, theta: float, lambda_: float, rho: float, eta: int, order: Iterable[int] | None = None
) -> int:
    """All elements at once: every free node goes to the mean of its places in its transformed elements.

    The mean is weighted by (1 − 1/q)^eta. Then the shifts are truncated and committed one after the other, in the given
    order of the nodes (default: ascending). Returns how many nodes moved.
    """
    sums = dict.fromkeys(mesh.free, (0.0, 0.0, 0.0))
    for element in elements_of(mesh):
        a, b, c = element
        z = (mesh.points[a], mesh.points[b], mesh.points[c])
        weight = (1.0 - shape(*z)) ** eta
        for node, place in zip(element, transformed(z, theta, lambda_, rho), strict=True):
            if node in sums:
                x, y, total = sums[node]
                sums[node] = (x + weight * place[0], y + weight * place[1], total + weight)
    moved = 0
    for node in mesh.free if order is None else order:
        here, (x, y, total) = mesh.points[node], sums[node]
        if total > 0.0:
            ring = [mesh.points[neighbour] for neighbour in mesh.rings[node]]
            mesh.points[node] = truncated(here, (x / total, y / total), ring)
            moved += mesh.points[node] != here
    return moved

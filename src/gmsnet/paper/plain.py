"""The classical node smoothers in plain Python, one node at a time: slow, and as obvious as can be.

They are what the compiled methods are tested against, and they are the framework of the paper's own timings (section 4:
all methods in Python, told apart only by how they find a node's new position). A method is a ``Move``; gathering the
ring, truncation and sequential updating are the same for all.

Rings are counter-clockwise: triangle j of a star is (x, ring[j], ring[j + 1]), its area positive where it is valid.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gmsnet.mesh.mesh import Mesh
from gmsnet.topology.topology import Topology

Point = tuple[float, float]
Move = Callable[[Point, list[Point]], Point]  # the new position of a free node, from its position and its ring

HALVINGS = 20  # as the compiled guard's: 2⁻²⁰ of a shift is none


@dataclass(eq=False)
class PlainMesh:
    """A mesh as lists.

    points: (x, y) of every node, replaced as nodes move. free: ids of the nodes that may move, ascending. rings: id of
    a free node → ids of its neighbours, counter-clockwise.
    """

    points: list[Point]
    free: list[int]
    rings: dict[int, list[int]]

    @classmethod
    def of(cls, mesh: Mesh, topology: Topology | None = None) -> PlainMesh:
        """From a planar mesh, in the coordinates of its plane."""
        topology = topology or Topology.of(mesh)
        start, ring = topology.patches
        free = topology.free.tolist()
        rings = {node: ring[start[k] : start[k + 1]].tolist() for k, node in enumerate(free)}
        points = [(x, y) for x, y in mesh.points[:, mesh.plane or (0, 1)].tolist()]
        return cls(points, free, rings)

    def array(self) -> NDArray[np.float64]:
        """The points as they stand, (N, 2)."""
        return np.array(self.points)


def sweep(mesh: PlainMesh, move: Move, nodes: Iterable[int] | None = None) -> int:
    """Visits the nodes (default: all free ones) one after the other; each sees where those before it went.

    Returns how many moved.
    """
    return sum(visit(mesh, node, move) for node in (mesh.free if nodes is None else nodes))


def visit(mesh: PlainMesh, node: int, move: Move) -> bool:
    """Gathers the ring, asks for the new position, truncates the shift and commits it; tells whether the node moved."""
    x = mesh.points[node]
    ring = [mesh.points[neighbour] for neighbour in mesh.rings[node]]
    mesh.points[node] = truncated(x, move(x, ring), ring)
    return mesh.points[node] != x


def truncated(x: Point, target: Point, ring: list[Point]) -> Point:
    """Algorithm 1: the shift halved for as long as it makes an element negative; x if that never ends.

    An element that is negative already may be so afterwards, if less. A target that is not finite is no target.
    """
    dx, dy = target[0] - x[0], target[1] - x[1]
    if not (math.isfinite(dx) and math.isfinite(dy)):
        return x
    for _ in range(HALVINGS):
        moved = (x[0] + dx, x[1] + dy)
        if not inverts(x, moved, ring):
            return moved
        dx, dy = 0.5 * dx, 0.5 * dy
    return x


def inverts(x: Point, moved: Point, ring: list[Point]) -> bool:
    """Is a triangle of the star not positive after the move, and no better than before it?"""
    for a, b in edges(ring):
        after = area(moved, a, b)
        if after <= 0.0 and after <= area(x, a, b):
            return True
    return False


def edges(ring: list[Point]) -> list[tuple[Point, Point]]:
    """The ring's edges (x_j, x_j+1)."""
    return list(zip(ring, ring[1:] + ring[:1], strict=True))


def area(a: Point, b: Point, c: Point) -> float:
    """Signed area of a triangle, positive if a, b, c are counter-clockwise."""
    return 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


def aspect_ratio(a: Point, b: Point, c: Point) -> float:
    """q = (l² + m² + n²)/(4√3·S) of a triangle of positive area."""
    return squares(a, b, c) / (4.0 * math.sqrt(3.0) * area(a, b, c))


def shape(a: Point, b: Point, c: Point) -> float:
    """1/q, with the sign of the area; 0 for a triangle without extent."""
    lengths = squares(a, b, c)
    return 4.0 * math.sqrt(3.0) * area(a, b, c) / lengths if lengths > 0.0 else 0.0


def squares(a: Point, b: Point, c: Point) -> float:
    """l² + m² + n² of a triangle's sides."""
    return sum((p[0] - q[0]) ** 2 + (p[1] - q[1]) ** 2 for p, q in ((a, b), (b, c), (c, a)))


def star_aspect_ratio(x: Point, ring: list[Point]) -> float:
    """The mean of q over the triangles of a star; infinite where one is not positive."""
    if min(area(x, a, b) for a, b in edges(ring)) <= 0.0:
        return math.inf
    return sum(aspect_ratio(x, a, b) for a, b in edges(ring)) / len(ring)


def star_shape(x: Point, ring: list[Point]) -> float:
    """The mean of 1/q over the triangles of a star: 1 − MetricLoss (equation 10)."""
    return sum(shape(x, a, b) for a, b in edges(ring)) / len(ring)


def weighted_mean(points: list[Point], weights: list[float]) -> Point:
    """Σ w·p / Σ w; not a number where the weights are infinite or sum to 0."""
    total = sum(weights)
    if total == 0.0 or not math.isfinite(total):
        return math.nan, math.nan
    pairs = list(zip(points, weights, strict=True))
    return sum(w * p[0] for p, w in pairs) / total, sum(w * p[1] for p, w in pairs) / total


def laplacian(x: Point, ring: list[Point]) -> Point:
    """The mean of the ring."""
    return weighted_mean(ring, [1.0] * len(ring))


def smart_laplacian(x: Point, ring: list[Point]) -> Point:
    """The mean of the ring if the star is the better for it (Field 1988); else x.

    Better is a smaller mean of q; in a star that is tangled, that no triangle that is not positive has become worse.
    """
    target = laplacian(x, ring)
    if inverts(x, target, ring):
        return x
    before = star_aspect_ratio(x, ring)
    return target if before == math.inf or star_aspect_ratio(target, ring) < before else x


def inverse_length_laplacian(x: Point, ring: list[Point]) -> Point:
    """The ring's mean, each node weighted by 1/|edge| from x."""
    return weighted_mean(ring, [1.0 / length if (length := math.dist(x, p)) > 0.0 else math.inf for p in ring])


def area_laplacian(x: Point, ring: list[Point]) -> Point:
    """The ring's mean, each node weighted by the areas of the two triangles at its edge from x."""
    before, after = ring[-1:] + ring[:-1], ring[1:] + ring[:1]
    areas = [abs(area(x, a, p)) + abs(area(x, p, b)) for a, p, b in zip(before, ring, after, strict=True)]
    return weighted_mean(ring, areas)


def angle(x: Point, ring: list[Point]) -> Point:
    """Zhou & Shimada (2000): x turned about each ring node onto the bisector of the angle there; the mean of these."""
    neighbours = zip(ring[-1:] + ring[:-1], ring, ring[1:] + ring[:1], strict=True)
    turned = [onto_bisector(x, before, node, after) for before, node, after in neighbours]
    return weighted_mean(turned, [1.0] * len(turned))


def onto_bisector(x: Point, before: Point, node: Point, after: Point) -> Point:
    """x turned about a ring node x_j until it is between the edges to the nodes before and after it.

    With v = x − x_j, and α₁ and α₂ the angles from v to the edges x_j → x_j+1 and x_j → x_j−1: v is turned by
    β = (α₂ − α₁)/2, counter-clockwise.
    """
    v = (x[0] - node[0], x[1] - node[1])
    beta = 0.5 * (angle_between(v, node, before) - angle_between(v, node, after))
    sine, cosine = math.sin(beta), math.cos(beta)
    return node[0] + cosine * v[0] - sine * v[1], node[1] + sine * v[0] + cosine * v[1]


def angle_between(v: Point, tail: Point, head: Point) -> float:
    """The angle in [0, π] between v and the edge tail → head; 0 if one of them has no length."""
    u = (head[0] - tail[0], head[1] - tail[1])
    sine, cosine = abs(v[0] * u[1] - v[1] * u[0]), v[0] * u[0] + v[1] * u[1]
    return math.atan2(sine, cosine) if sine != 0.0 or cosine != 0.0 else 0.0  # atan2(0, −0) is π


def cvt(x: Point, ring: list[Point]) -> Point:
    """Equation 1: the circumcentres of the triangles, weighted by their areas.

    Where a triangle is flat its circumcentre is infinitely far, but the product with its area is not: see
    ``area_times_circumcentre``.
    """
    return _by_areas(x, ring, [area_times_circumcentre(x, a, b) for a, b in edges(ring)])


def cpt(x: Point, ring: list[Point]) -> Point:
    """Equation 1 with centroids in the place of circumcentres."""
    thirds = [abs(area(x, a, b)) / 3.0 for a, b in edges(ring)]
    off = [(a[0] + b[0] - 2.0 * x[0], a[1] + b[1] - 2.0 * x[1]) for a, b in edges(ring)]
    return _by_areas(x, ring, [(w * u, w * v) for w, (u, v) in zip(thirds, off, strict=True)])


def area_times_circumcentre(x: Point, a: Point, b: Point) -> Point:
    """|T|·(C − x) of the triangle T = (x, a, b) with the circumcentre C.

    With a and b from x on, C = (b_y|a|² − a_y|b|², a_x|b|² − b_x|a|²)/(4S): |T| = ±S cancels S, so that the product
    stays finite as S → 0. A triangle without area counts as the limit of positive ones.
    """
    ax, ay, bx, by = a[0] - x[0], a[1] - x[1], b[0] - x[0], b[1] - x[1]
    quarter = -0.25 if area(x, a, b) < 0.0 else 0.25
    aa, bb = ax * ax + ay * ay, bx * bx + by * by
    return quarter * (by * aa - ay * bb), quarter * (ax * bb - bx * aa)


def _by_areas(x: Point, ring: list[Point], products: list[Point]) -> Point:
    """x + Σ products / Σ|T|; not a number where no triangle has an area."""
    total = sum(abs(area(x, a, b)) for a, b in edges(ring))
    if total == 0.0:
        return math.nan, math.nan
    return x[0] + sum(u for u, _ in products) / total, x[1] + sum(v for _, v in products) / total

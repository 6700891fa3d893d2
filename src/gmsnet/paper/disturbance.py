"""How the good meshes of the airfoil and the pipe are spoilt: the paper's nodes "manually adjusted", as a rule.

Two things can be read off its Origin rows: how much the means fall, which many small throws do, and how flat the worst
cell is, which a few large ones do. So there are both, each with its own strength.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gmsnet.generate import disturb
from gmsnet.mesh.mesh import Mesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

HALVINGS = 60


@dataclass(frozen=True)
class Disturbance:
    """share: of the inner nodes, thrown to a random place up to ``amount`` of their mean edge length away, or less far
    where a cell would get an angle below ``flattest``.

    pushed: so many other nodes, no two of which are neighbours, are pushed in a random direction until the smallest
    angle around them is a random one between ``flattest`` and 1.5 times as much (degrees).
    """

    share: float
    amount: float
    pushed: int
    flattest: float

    def applied(self, mesh: Mesh, seed: int) -> Mesh:
        """The disturbed mesh: its triangles stay valid, the nodes of its line cells stand still."""
        triangles, lines = mesh.cells
        rng = np.random.default_rng(seed)
        inner = np.setdiff1d(np.arange(len(mesh.points)), lines.nodes)
        thrown = rng.permutation(inner)[: round(self.share * len(inner))]
        points = self._thrown(mesh, thrown, int(rng.integers(2**32)))
        for node in self._to_push(inner, triangles.nodes, rng):
            angle = self.flattest * rng.uniform(1.0, 1.5)
            push(points, triangles.nodes, node, float(rng.uniform(0.0, 2 * np.pi)), angle)
        return mesh.with_points(points)

    def _thrown(self, mesh: Mesh, nodes: Ints, seed: int) -> Floats:
        """The points (N × 2) after the throws, halved until no cell is flatter than the flattest that is wanted."""
        triangles = mesh.cells[0].nodes
        shift = disturb(mesh, nodes, self.amount, seed=seed).points - mesh.points
        for _ in range(HALVINGS):
            points = mesh.points + shift
            a, b, c = (points[triangles[:, k]] for k in range(3))
            flat = (min_angle(a, b, c) < self.flattest) | (cross(b - a, c - a) <= 0.0)
            if not flat.any():
                break
            shift[np.unique(triangles[flat])] *= 0.5
        return mesh.points + shift

    def _to_push(self, inner: Ints, triangles: Ints, rng: np.random.Generator) -> list[int]:
        """Random inner nodes, no two of which are neighbours."""
        chosen: list[int] = []
        for node in rng.permutation(inner).tolist():
            if len(chosen) == self.pushed:
                break
            if not np.isin(triangles[(triangles == node).any(axis=1)], chosen).any():
                chosen.append(node)
        return chosen


def push(points: Floats, triangles: Ints, node: int, direction: float, angle: float) -> None:
    """Moves a node (in place) until the smallest angle of the triangles around it is ``angle`` (degrees).

    points: (N × 2). triangles: (T × 3) counter-clockwise. direction: in radians. Where the smallest angle is less than
    that already, the node stands still.
    """
    star = triangles[(triangles == node).any(axis=1)]
    turned = np.array([np.roll(row, -int(np.flatnonzero(row == node)[0])) for row in star])  # the node first
    a, b = points[turned[:, 1]], points[turned[:, 2]]
    start, heading = points[node].copy(), np.array([np.cos(direction), np.sin(direction)])

    def smallest(way: float) -> float:
        return float(min_angle(start + way * heading, a, b).min())

    # The area of a cell is linear in the way: where does the first one vanish?
    area, change = cross(a - start, b - start), -cross(np.broadcast_to(heading, a.shape), b - a)
    near, far = 0.0, float((area[change < 0] / -change[change < 0]).min())
    if smallest(near) <= angle:
        return
    for _ in range(HALVINGS):
        middle = (near + far) / 2
        near, far = (middle, far) if smallest(middle) > angle else (near, middle)
    points[node] = start + near * heading


def min_angle(apex: Floats, a: Floats, b: Floats) -> Floats:
    """(n,) the smallest angle, in degrees, of triangles with an apex (2,) or (n × 2) and edges a → b (n × 2 each)."""
    corners = (np.broadcast_to(apex, a.shape), a, b)
    angles = []
    for k in range(3):
        to_next, to_last = corners[(k + 1) % 3] - corners[k], corners[(k + 2) % 3] - corners[k]
        angles.append(np.arctan2(np.abs(cross(to_next, to_last)), (to_next * to_last).sum(axis=1)))
    return np.asarray(np.degrees(np.min(angles, axis=0)))


def cross(u: Floats, v: Floats) -> Floats:
    """(n,) the z component of the cross products of vectors (n × 2)."""
    return np.asarray(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])

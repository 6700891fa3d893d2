"""A metric as a function of place, in the units and the order in memory of the mesh that is smoothed.

It is given at the nodes of the input, and linear in its logarithm on the input's triangles; or by a function, which is
asked for the nodes as they are. In between, where the nodes are on their way, a function counts as linear in its
logarithm on the mesh as it was last.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.metric import places
from gmsnet.kernels.metric.places import Background
from gmsnet.kernels.metric.quality import EQUILATERAL_AREA, SQUARE_AREA
from gmsnet.topology.topology import Topology

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

LARGEST = 700.0  # of a logarithm of a float64, about
PARTS = 4  # a triangle is parted into the square of it to find its area in the metric


@dataclass(frozen=True, eq=False)
class Metric:
    """Where a metric comes from. triangles, adjacent, first: of a Background of the mesh, by places in memory.

    given: at the nodes of the input, which does not change. function: from points (n, 2) in the mesh's own units to
    logarithms (n, 3); one of the two is None. exponent: of ``planar_points``. unit: added to t, so that the mesh has as
    many cells as the metric asks for. own: it was recovered from the mesh itself, and its scale has no meaning.
    """

    triangles: Ints
    adjacent: Ints
    first: Ints
    given: Background | None
    function: Callable[[Floats], Floats] | None
    exponent: int
    unit: float = 0.0
    own: bool = False

    @classmethod
    def at_nodes(
        cls, topology: Topology, points: Floats, logs: Floats, exponent: int = 0, *, own: bool = False
    ) -> Metric:
        """Of logarithms (N, 3) at the nodes, and of points (N, 2), both in memory order; logs in the mesh's own units
        unless ``exponent`` is 0."""
        triangles, adjacent, first = _connected(topology)
        logs = logs + np.array([math.log(4.0) * exponent, 0.0, 0.0])
        given = Background(points, triangles, adjacent, first, np.ascontiguousarray(logs))
        return cls(triangles, adjacent, first, given, None, exponent, own=own)._scaled(topology, points)

    @classmethod
    def of_place(
        cls, topology: Topology, points: Floats, function: Callable[[Floats], Floats], exponent: int
    ) -> Metric:
        """By a function of points (n, 2), in the mesh's own units. points: (N, 2) in memory order."""
        return cls(*_connected(topology), None, function, exponent)._scaled(topology, points)

    def at(self, points: Floats) -> Floats:
        """The logarithms (N, 3) at the nodes, which are at points (N, 2)."""
        found: Floats = self._logs(points, self.first) + np.array([self.unit, 0.0, 0.0])
        return found

    def background(self, points: Floats) -> Background:
        """What the metric is between nodes at points (N, 2)."""
        if self.given is None:
            return Background(points, self.triangles, self.adjacent, self.first, self.at(points))
        return self.given._replace(logs=self.given.logs + np.array([self.unit, 0.0, 0.0]))

    def _logs(self, points: Floats, first: Ints) -> Floats:
        """At any points (n, 2). first: (n,) a triangle near each."""
        if self.given is None:
            assert self.function is not None
            logs = self.function(np.ldexp(points, self.exponent)).copy()
            logs[:, 0] += math.log(4.0) * self.exponent
            return logs
        logs = np.empty((len(points), 3))
        places.evaluate(self.given, points, first.copy(), logs, np.empty((len(points), 3, 2)))
        return logs

    def _scaled(self, topology: Topology, points: Floats) -> Metric:
        """With the unit. The area of the domain in the metric is found by PARTS² midpoints a triangle."""
        corners = points[self.triangles]
        a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        part = 0.5 * np.maximum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], 0.0) / PARTS**2
        middles, triangle = _midpoints(PARTS), np.arange(len(self.triangles), dtype=np.int32)
        found = [self._logs(np.einsum("c,tcx->tx", share, corners), triangle)[:, 0] for share in middles]
        largest = max((float(t.max()) for t in found if len(t)), default=0.0)
        total = sum(float((part * np.exp(t - largest)).sum()) for t in found)
        wanted = 0.5 * EQUILATERAL_AREA * len(topology.triangles) + SQUARE_AREA * len(topology.quads)
        return replace(self, unit=math.log(wanted / total) - largest) if total > 0.0 and wanted > 0.0 else self

    def stretched(self, ratio: float) -> int:
        """How many nodes of the input have a metric whose unit cells are so many times as long as wide, or more."""
        if self.given is None:
            return 0
        logs = self.given.logs
        return int((np.hypot(logs[:, 1], logs[:, 2]) >= math.log(ratio)).sum())

    @property
    def reachable(self) -> float:
        """How long edges become, in the metric as it is given, if the mesh conforms to it as its cells allow."""
        return math.exp(min(max(-0.5 * self.unit, -LARGEST), LARGEST))


def _midpoints(parts: int) -> Floats:
    """(parts², 3) barycentric coordinates of the middles of equal parts of a triangle."""
    found = []
    for i in range(parts):
        for j in range(parts - i):
            found.append((i + 1 / 3, j + 1 / 3))
            if i + j < parts - 1:
                found.append((i + 2 / 3, j + 2 / 3))
    one, two = np.array(found).T / parts
    return np.column_stack([one, two, 1.0 - one - two])


def _connected(topology: Topology) -> tuple[Ints, Ints, Ints]:
    """The triangles and halves of quads by places in memory, what is adjacent to them, and one of each node."""
    rows = [_counter_clockwise(topology.triangles, topology.orientation)]
    if len(topology.quads):
        quads = _counter_clockwise(topology.quads, topology.quad_orientation)
        rows += [quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]
    triangles = np.ascontiguousarray(topology.places[np.concatenate(rows)], dtype=np.int32)
    start, end = np.roll(triangles, -1, axis=1).ravel(), np.roll(triangles, -2, axis=1).ravel()
    keys = np.minimum(start, end).astype(np.int64) * len(topology.memory) + np.maximum(start, end)
    adjacent = np.empty_like(triangles)
    places.adjacency(triangles, np.argsort(keys, kind="stable"), keys, adjacent)
    first = np.full(len(topology.memory), -1, dtype=np.int32)
    first[triangles] = np.arange(len(triangles), dtype=np.int32)[:, None]
    return triangles, adjacent, first


def _counter_clockwise(cells: Ints, orientation: NDArray[np.int8]) -> Ints:
    return np.where(orientation[:, None] > 0, cells, cells[:, ::-1])

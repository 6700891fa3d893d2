"""How a mesh conforms to a metric: the quality of its cells in it, and the lengths of its edges."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.metric.quality import qualities
from gmsnet.kernels.simplex.mean_ratio2 import WEIGHTS, Simplices
from gmsnet.metric.field import Metric
from gmsnet.metric.tensors import tensors_of
from gmsnet.topology.topology import Topology

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

NEAR = 0.2  # of a length: so far from it an edge may be
TINY = 1e-300


@dataclass(frozen=True)
class Conformity:
    """How a mesh conforms to a metric.

    least, mean: of the quality of cells in it, in (0, 1], of shape and size (kernels/metric/quality.py); sizes are
    compared with those that the number of cells allows. edges: how many there are. length: the mean of their lengths in
    the metric; near_one, near_mean: the shares of those within ±20 % of 1 and of that mean. quasi_unit: the share of
    those from 1/√2 to √2.

    Source of the last: A. Loseille, F. Alauzet, "Continuous mesh framework", SIAM Journal on Numerical Analysis 49,
    2011.
    """

    least: float
    mean: float
    edges: int
    length: float
    near_one: float
    near_mean: float
    quasi_unit: float

    @classmethod
    def of(cls, points: Floats, topology: Topology, metric: Metric) -> Conformity:
        """Of nodes at points (N, 2), in memory order."""
        logs = metric.at(points)
        values = cell_qualities(points, topology.simplices, logs)
        lengths = metric.reachable * edge_lengths(points, logs, edges_of(topology))
        mean = float(lengths.mean()) if len(lengths) else float("nan")
        near = [float((np.abs(lengths - goal) <= NEAR * goal).mean()) if len(lengths) else mean for goal in (1.0, mean)]
        unit = float((np.abs(np.log2(np.maximum(lengths, TINY))) <= 0.5).mean()) if len(lengths) else mean
        least, quality = float(values.min(initial=1.0)), float(values.mean()) if len(values) else mean
        return cls(least, quality, len(lengths), mean, near[0], near[1], unit)

    def figures(self) -> list[tuple[str, str]]:
        """(name, value) for tables."""
        return [
            ("quality in the metric, least", f"{self.least:.4f}"),
            ("quality in the metric, mean", f"{self.mean:.4f}"),
            ("edges: mean length in it", f"{self.length:.4f}"),
            ("edges within 20 % of 1", f"{self.near_one:.2%}"),
            ("edges within 20 % of mean", f"{self.near_mean:.2%}"),
            ("edges from 1/√2 to √2", f"{self.quasi_unit:.2%}"),
        ]

    def summary(self) -> dict[str, Any]:
        """Plain numbers, ready for JSON."""
        return asdict(self)


class ConformityChange(NamedTuple):
    """How the input of a run conformed to the metric, and how its result does."""

    before: Conformity
    after: Conformity

    def rows(self) -> list[list[str]]:
        """Name, before and after of each figure."""
        return [[*one, other] for one, (_, other) in zip(*(each.figures() for each in self), strict=True)]


def oriented(simplices: Simplices) -> tuple[Ints, Floats | None]:
    """The rows (S, 3) of corner simplices counter-clockwise, and the weights (S, 3) of their edges, None if all 1."""
    rows, orientation = simplices.rows, simplices.orientation
    cells = np.where(orientation[:, None] > 0, rows, rows[:, [0, 2, 1]])
    return np.ascontiguousarray(cells), None if simplices.shapes is None else WEIGHTS[simplices.shapes]


def cell_qualities(points: Floats, simplices: Simplices, logs: Floats) -> Floats:
    """The quality of each cell in the metric, of its worst corner. logs: (N, 3) at the nodes."""
    cells, table = oriented(simplices)
    values = np.empty(len(cells))
    qualities(points, cells, table, logs, values)
    if simplices.cells is None or not len(values):
        return values
    least: Floats = np.minimum.reduceat(values, np.flatnonzero(np.append(True, np.diff(simplices.cells) != 0)))
    return least


def edges_of(topology: Topology) -> Ints:
    """(E, 2) the edges of all cells whose nodes may move, by places in memory."""
    ends = [topology.triangles[:, [k, (k + 1) % 3]] for k in range(3)]
    ends += [topology.quads[:, [k, (k + 1) % 4]] for k in range(4)]
    pairs = np.sort(topology.places[np.concatenate(ends)], axis=1).astype(np.int64)
    keys = np.sort(pairs[:, 0] * len(topology.memory) + pairs[:, 1])  # np.unique hashes, which takes five times as long
    keys = keys[np.append(True, keys[1:] != keys[:-1])] if len(keys) else keys
    return np.column_stack(np.divmod(keys, len(topology.memory))).astype(np.int32)


def edge_lengths(points: Floats, logs: Floats, edges: Ints) -> Floats:
    """(E,) in a metric whose length of each edge changes by one factor per way from one end to the other.

    Source: F. Alauzet, "Size gradation control of anisotropic meshes", Finite Elements in Analysis and Design 46, 2010.
    """
    x, y = (points[edges[:, 1]] - points[edges[:, 0]]).T
    roots = tensors_of(0.5 * logs)  # of the tensors: the squares of very flat ones cancel
    one, other = (
        np.hypot(m[:, 0] * x + m[:, 1] * y, m[:, 1] * x + m[:, 2] * y) for m in (roots[edges[:, 0]], roots[edges[:, 1]])
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.log(other / one)
        between = (other - one) / ratio
    alike = ~(np.abs(ratio) > 1e-6)  # the mean then, up to rounding
    return np.asarray(np.where(alike, 0.5 * (one + other), between))

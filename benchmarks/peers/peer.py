"""What a tool is: a row that tells about it, and a class that runs it on a mesh."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol

import numpy as np

AVERAGING, QUALITY, OURS = "averaging without a check", "driven by quality", "gmsnet"


@dataclass(frozen=True)
class Peer:
    """A row of the table.

    kind: AVERAGING, QUALITY or OURS. tool: "module:class" in this folder. packages: distributions that must be there,
    whose versions are printed, the tool's own first. efforts: ascending, the last one for the final state; empty where
    the tool itself says them. counts: what the efforts count. options: arguments of the class. licence: of the tool.
    most_nodes: of larger meshes it is left out, because it would take hours. note: what else there is to know. program:
    for a tool in a program of its own, the environment variable that names it.
    """

    name: str
    kind: str
    tool: str
    packages: tuple[str, ...]
    efforts: tuple[int, ...]
    counts: str
    licence: str
    options: Mapping[str, Any] = field(default_factory=dict)
    most_nodes: float = float("inf")
    note: str = ""
    program: str = ""


class Tool(Protocol):
    """A tool at work on one mesh. ``Tool(plane, **options)`` is the set-up.

    One in a program of its own has ``seconds``, too: what set-up, smoothing and the way back took there.
    """

    def smooth(self, effort: int) -> None: ...

    def points(self) -> np.ndarray:
        """(N, 2) or (N, 3), in the order of the input."""

    def cells(self) -> np.ndarray | None:
        """(T, 3) as the tool has them now, by numbers of the input.

        None for a tool that has no cells of its own, and of mixed meshes.
        """


@dataclass(frozen=True, eq=False)
class Plane:
    """The mesh that a tool gets: points (N, 2) float64, cells (T, 3) int64, counter-clockwise, of the unit square.

    quads: (Q, 4) int64, the other cells of a mixed mesh. The other properties are for tools that need to be told; they
    are computed when they are asked for, in the set-up of those tools.
    """

    points: np.ndarray
    cells: np.ndarray
    quads: np.ndarray = field(default_factory=lambda: np.empty((0, 4), dtype=np.int64))

    @classmethod
    def load(cls, path: str | Path) -> Plane:
        with np.load(path) as arrays:
            return cls(**arrays)

    @cached_property
    def edges(self) -> tuple[np.ndarray, np.ndarray]:
        """The tail and the head of each cell's edges, (3T + 4Q,) int32 each: inner edges come in both directions."""
        kinds = [cells.astype(np.int32).T for cells in (self.cells, self.quads)]
        tail = np.concatenate([cells.ravel() for cells in kinds])
        return tail, np.concatenate([np.roll(cells, -1, axis=0).ravel() for cells in kinds])

    @cached_property
    def held(self) -> np.ndarray:
        """(N,) bool: which nodes are on the boundary.

        A node that is not has the same nodes before it as after it, so these have the same sum; one on a simple
        boundary has one after it that is not before it, and the other way round.
        """
        tail, head = self.edges
        count = len(self.points)
        return np.bincount(tail, head, count) != np.bincount(head, tail, count)

    @cached_property
    def segments(self) -> np.ndarray:
        """(B, 2) int32: the edges of the boundary, the mesh to their left."""
        tail, head = self.edges
        near = self.held[tail] & self.held[head]
        tail, head = tail[near].astype(np.int64), head[near].astype(np.int64)
        count = len(self.points)
        single = ~np.isin(tail * count + head, head * count + tail)
        return np.column_stack([tail[single], head[single]]).astype(np.int32)

    @cached_property
    def space(self) -> np.ndarray:
        """(N, 3): the points with z = 0."""
        return np.column_stack([self.points, np.zeros(len(self.points))])

"""Who carries out the work on a mesh: one thread, several, or (so that nothing stands against it) several processes.

A sweep gives an executor ranges of blocks, tells it where a colour ends, and asks it for figures of the whole mesh. An
executor of processes works on the blocks of its own part of the mesh, sends its neighbours the places of nodes that
have moved after each colour, and forms the figures with the other processes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

Result = TypeVar("Result")
Figure = TypeVar("Figure", float, NDArray[np.float64])
Figures = TypeVar("Figures", bound=NDArray[Any])


class Executor(Protocol):
    """See the module. Every process of an executor calls the same functions in the same order."""

    @property
    def sequential(self) -> bool:
        """``map`` works a range off from its first to its last, and nothing is to be done after a colour.

        The colours of a sweep may then be given as one range.
        """
        ...

    def map(self, work: Callable[[int, int], Result], first: int, last: int) -> list[Result]:
        """What ``work`` returns for the pieces of a range first…last, in the order of the pieces; at least one.

        What a piece raises is raised here, when no other piece is worked on any more.
        """
        ...

    def swept(self, visit: Any, stars: Any, points: NDArray[np.float64], guard: Any) -> NDArray[np.int64] | None:
        """A sweep over all stars in a plane by other means than ``map``: what happened to the shifts.

        None where there are none. visit: a kernels.star.block.Visit. stars: with ``blocks`` and ``first``.
        """
        ...

    def figures(
        self, summary: Any, points: NDArray[np.float64], cells: tuple[Any, ...], rest: tuple[Any, ...]
    ) -> Iterable[NDArray[np.float64]] | None:
        """The figures of parts of a mesh by other means than ``map``; None where there are none.

        summary: a kernels.simplex.summary.Summary; cells, rest: what its kernel is called with.
        """
        ...

    def after_colour(self, colour: int, points: NDArray[np.float64]) -> None:
        """All nodes of a colour are where they will be; points: (N, 2) of all nodes, in memory order."""
        ...

    def exchange(self, values: NDArray[np.float64]) -> None:
        """Values (N,) at nodes, in memory order, become everywhere what they are where the node moves."""
        ...

    def lowest(self, values: NDArray[np.float64], share: int, fewest: int) -> NDArray[np.int32]:
        """Which blocks of cells have the lowest values: one in ``share`` of all that there are, at least so many.

        values: one for each block of this process. Of equal ones those of the lower number come first.
        """
        ...

    def lowest_rows(
        self, values: NDArray[np.float64], many: int, rows: NDArray[np.int32] | None = None
    ) -> NDArray[np.int32]:
        """Which of the corner simplices that can change have the lowest values: so many, or all if they are fewer.

        values: one for each row of ``changeable``, or of some ``rows``. Of equal ones those that come first in the
        whole mesh. Returns indices into ``values``, ascending.
        """
        ...

    def counted(self, flags: NDArray[np.bool_]) -> int:
        """How many rows of ``changeable`` are flagged, each once. flags: (S,)."""
        ...

    def cell_count(self, simplices: Any) -> int:
        """How many cells the rows of ``changeable`` belong to. simplices: these rows."""
        ...

    def every(self, stride: int, length: int, size: int = 1) -> NDArray[np.int32]:
        """Of so many rows of ``changeable`` those in every stride-th block of ``size`` of the whole mesh, each once."""
        ...

    def row_numbers(self, rows: NDArray[np.int32]) -> NDArray[np.int64]:
        """The places in the whole mesh of rows of ``changeable``."""
        ...

    def free_numbers(self, near_free: NDArray[np.bool_]) -> NDArray[np.int64]:
        """The places, among the free nodes of the whole mesh, of those that are free here, in memory order."""
        ...

    def in_order(self, numbers: NDArray[np.int64], values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values (K, …) of all processes in the order of their numbers, which are ascending here."""
        ...

    def nth(self, values: NDArray[np.float64], number: int) -> float:
        """The value at this place, from 1 on, of those of all processes in their order; ∞ where there is none.

        If they are fewer, the last one.
        """
        ...

    def gathered(self, field: Any) -> Any:
        """The whole mesh that is smoothed: a Field on one process, None on the others."""
        ...

    def dealt(self, field: Any, rows: NDArray[np.int32]) -> Any:
        """What is smoothed, with all cells at the free nodes of some rows of ``changeable``, of all processes.

        Those nodes alone are free. Each process has a Field of some of them, or None, and no cell with such nodes is
        on two. A single process has ``field`` itself, where more nodes may be free.
        """
        ...

    def gathered_around(self, field: Any, corners: NDArray[np.int32], rings: int) -> tuple[Any, NDArray[np.int32]]:
        """The free nodes within so many rings of some cells of all processes on one of them, and these cells there.

        corners: (K, 3 or 4) of the cells; of all processes each comes once.
        """
        ...

    def cells_returned(self, part: Any, corners: NDArray[np.int32]) -> NDArray[np.int32]:
        """Cells (K, 3 or 4) of what was gathered, which has them: those of them that are here, by places in memory."""
        ...

    def called_alone(self, callback: Callable[[Any], Any] | None) -> Callable[[Any], Any] | None:
        """A callback as the process calls it by itself that has what was gathered."""
        ...

    def restricted(self, topology: Any, active: NDArray[np.bool_]) -> Any:
        """A topology in which the active nodes (N,) by places in memory alone are free, of those that are free here."""
        ...

    def holding(self, topology: Any, nodes: NDArray[np.bool_], reason: str) -> Any:
        """The topology with more nodes held, (N,) bool by id, for this reason."""
        ...

    def of(self, topology: Any) -> Executor:
        """The executor for what was ``restricted`` or made by ``holding``, and for others this one."""
        ...

    def lent(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values (N,) at nodes, in memory order, for what was gathered or dealt last: in its order, where it is."""
        ...

    def returned(self, field: Any, part: Any, result: Result) -> Result:
        """The points of what was gathered or dealt go back into ``field``; returns the result of the first process."""
        ...

    def blocks_with(self, rows: NDArray[np.int32], size: int) -> NDArray[np.int32]:
        """The blocks of ``changeable``, of so many rows, that have some of these rows, of any process."""
        ...

    def minimum(self, value: Figure) -> Figure:
        """The least of what all processes give; of an array, for each of its places."""
        ...

    def total(self, figures: Figures) -> Figures:
        """The sums of what all processes give, for each place of an array.

        The sums must be exact, so that they have the same bits in any order: whole numbers, or numbers on the grid of
        ``kernels.simplex.measures.grids``.
        """
        ...

    def for_blocks(self, blocks: int) -> Executor:
        """The executor for a mesh of so many blocks: one that is sequential where sharing them out does not pay."""
        ...

    def remarks(self) -> tuple[str, ...]:
        """What there is to say of who did the work."""
        ...

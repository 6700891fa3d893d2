"""Figures of the parts of a mesh in a plane, from which those of the whole follow in any order."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from gmsnet.kernels.simplex import cell_measures, measures


class Summary(NamedTuple):
    """What says what blocks of corner simplices are like: called with points, *cells, first, last and *rest.

    kernel: returns figures (F,); part: writes them into an array that it is called with besides. The least, or the
    most, of those in ``least`` and ``most`` is that of the whole, and the sum of all others.
    """

    kernel: Callable[..., Any]
    part: Callable[..., Any]
    figures: int
    least: tuple[int, ...]
    most: tuple[int, ...] = ()


TRIANGLES = Summary(measures.summarise, measures.summarise_into, measures.FIGURES, measures.LEAST, measures.MOST)
CELLS = Summary(
    cell_measures.summarise_cells, cell_measures.summarise_cells_into, cell_measures.FIGURES, (cell_measures.MINIMUM,)
)

"""What PyVista's users call: ``mesh.gmsnet``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Generic, TypeVar

import numpy as np

from gmsnet.errors import InputError
from gmsnet.measure.report import QualityReport, measure
from gmsnet.mesh.adapters import to_mesh
from gmsnet.run.api import smooth
from gmsnet.run.progress import Progress
from gmsnet.run.smooth_result import SmoothResult
from gmsnet.run.sweep import MOST_SWEEPS

PREFIX = "gmsnet_"  # of cell arrays: PyVista's own measures have some of these names
CELL = f"{PREFIX}cell"
FURTHER = ("scaled_jacobian", "valid")  # measures that are no columns of a report


DataSet = TypeVar("DataSet")


def accessor_of(dataset: DataSet) -> Accessor[DataSet]:
    """``dataset.gmsnet``, with types: checkers cannot see attributes that a library adds to another one's classes."""
    return Accessor(dataset)


class Accessor(Generic[DataSet]):
    """``mesh.gmsnet`` of a ``PolyData`` or an ``UnstructuredGrid``.

    Its methods raise ``gmsnet.InputError`` for what cannot be smoothed or measured; the message says how to mend it.
    """

    def __init__(self, dataset: DataSet) -> None:
        self._dataset: Any = dataset

    def smooth(
        self, method: str = "auto", *, inplace: bool = False, progress_bar: bool = False, **options: Any
    ) -> DataSet:
        """Moves the free nodes so that cells become better; no valid cell becomes inverted, all else stays.

        method, options: those of ``gmsnet.smooth``. inplace: give this data set the new points instead of a copy.
        progress_bar: show the sweeps. Returns the data set with the new points, of the same type.
        """
        made: DataSet = self.report(method, progress_bar=progress_bar, **options).mesh
        if not inplace:
            return made
        self._dataset.points = made.points  # type: ignore[attr-defined]
        return self._dataset  # type: ignore[no-any-return]

    def report(self, method: str = "auto", *, progress_bar: bool = False, **options: Any) -> SmoothResult:
        """The same with all that there is to tell: measures before and after, held nodes, and ``mesh``, the result."""
        with Progress(options.get("max_sweeps", MOST_SWEEPS), bar=progress_bar) as progress:
            options["callback"] = progress.before(options.get("callback"))
            return smooth(self._dataset, method, **options)

    def quality(self, measures: str | Sequence[str] = "shape", *, inplace: bool = False) -> DataSet:
        """The data set with a cell array ``gmsnet_NAME`` for each measure; nan for cells that are not measured.

        measures: names of columns of ``gmsnet.QualityReport``, such as "shape", "min_angle", "scaled_jacobian" and
        "valid", or "all". inplace: add the arrays to this data set. Returns a copy otherwise.
        """
        marked = self._dataset.copy(deep=False)
        marked.cell_data[CELL] = np.arange(marked.n_cells)  # lines of many nodes are several cells of a Mesh
        mesh = to_mesh(marked)[0]
        found = measure(mesh)
        cells = np.concatenate([np.zeros(0, dtype=np.int64), *mesh.cell_data[CELL]])[found.cell]
        made: Any = self._dataset if inplace else self._dataset.copy()
        for name in _names(found, measures):
            values = np.full(made.n_cells, np.nan)
            values[cells] = getattr(found, name)
            made.cell_data[PREFIX + name] = values
        return made  # type: ignore[no-any-return]


def _names(found: QualityReport, measures: str | Sequence[str]) -> list[str]:
    known = list(dict.fromkeys([*found.cells.names, *FURTHER]))
    if isinstance(measures, str):
        measures = known if measures == "all" else [measures]
    for name in measures:
        if name not in known:
            raise InputError(f"unknown measure {name!r}: these cells have {', '.join(known)}, or all of them by 'all'")
    return list(measures)

"""A report in plain numbers: extremes, means, percentiles and counts beyond thresholds."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.measure.cells import MeasuredCells
from gmsnet.measure.defects import NAMED, defects_of
from gmsnet.measure.solids import MeasuredSolids
from gmsnet.measure.totals import Totals
from gmsnet.measure.volumes import MeasuredTetrahedra
from gmsnet.parallel.executor import Executor
from gmsnet.parallel.threads import serial

Floats = NDArray[np.float64]

THRESHOLDS: dict[str, tuple[float, ...]] = {
    "min_angle": (5.0, 10.0, 20.0, 30.0), "max_angle": (120.0, 150.0, 170.0), "shape": (0.1, 0.2, 0.3, 0.5),
    "min_dihedral": (5.0, 10.0, 20.0, 30.0), "max_dihedral": (150.0, 165.0, 175.0),
}  # fmt: skip
BEST_IS_LOW = ("max_angle", "max_dihedral")
CHUNK = 1 << 15  # values are added up at a time
HALF = 26  # bits of the halves of a sum: those of 2³⁶ cells do not overflow


def summary_of(
    cells: MeasuredCells | MeasuredTetrahedra | MeasuredSolids, totals: Totals | None, inverted: int,
    column: Callable[[str], Floats],
) -> dict[str, Any]:  # fmt: skip
    """See ``QualityReport.summary``. column: the (T,) values of a measure, by its name."""
    document: dict[str, Any] = {**cells.counts, "inverted": inverted}
    if totals is None:
        return document
    triangles = isinstance(cells, MeasuredCells) and cells.order is None
    known = None if isinstance(cells, MeasuredSolids) else totals
    document |= measures_of(cells.names, known, column, triangles=triangles)
    if isinstance(cells, MeasuredSolids):
        defects = {what: (len(rows), rows[:NAMED].tolist()) for what, rows in defects_of(cells).items()}
        turned = {kind: len(numbers) for kind, numbers in cells.turned.items()}
        document |= of_solids(cells.undecided, len(cells.invalid_inside), turned, defects)
        bounds = cells.curved_bounds()
        if len(bounds):
            document["curved"] = {"min": float(bounds.min()), "mean": float(bounds.mean())}
    return {**document, **qhats(totals)} if triangles else document


def measures_of(
    names: Sequence[str],
    totals: Totals | None,
    column: Callable[[str], Floats],
    *,
    triangles: bool,
    over: Executor = serial,
) -> dict[str, dict[str, Any]]:
    """What there is to say of each measure. names: of all that the cells have. triangles: all of them are.

    totals: of which the means are taken, None where they have other sums. column: the values of a process; over: forms
    the figures of all.
    """
    document: dict[str, dict[str, Any]] = {}
    known = {} if totals is None else {"shape": totals.shape_mean}
    if triangles and totals is not None:
        known |= {"min_angle": totals.low_mean, "max_angle": totals.high_mean, "aspect": totals.aspect_mean}
    names = [name for name in names if triangles or name != "aspect"]
    names += [] if triangles or "scaled_jacobian" in names else ["scaled_jacobian"]
    for name in names:
        values, mean = column(name), known.get(name, math.nan)
        best_is_low = name in BEST_IS_LOW
        document[name] = {
            "min": over.minimum(float(values.min(initial=math.inf))),
            "mean": mean_of(values, over) if math.isnan(mean) else mean,
            "max": -over.minimum(-float(values.max(initial=-math.inf))),
            "p1": percentile(values, 99 if best_is_low else 1, over),
        }
        for limit in THRESHOLDS.get(name, ()):
            beyond = np.count_nonzero(values > limit if best_is_low else values < limit)
            document[name][f"{'above' if best_is_low else 'below'}_{limit:g}"] = int(over.total(np.array([beyond]))[0])
    return document


def qhats(totals: Totals) -> dict[str, float]:
    """Of triangles, q̂ with both kinds of 1/q."""
    return {"qhat": totals.qhat, "qhat_aspect": totals.qhat_aspect}


def of_solids(
    undecided: int, invalid_inside: int, turned: Mapping[str, int], defects: Mapping[str, tuple[int, list[int]]]
) -> dict[str, Any]:
    """What else there is to say of volumes of any kinds, as plain numbers.

    turned: kind → how many cells are read inside out. defects: what is wrong → how many cells, and the first of them.
    """
    return {
        "undecided": undecided,
        "invalid_inside": invalid_inside,
        "read_inside_out": dict(turned),
        "defects": {what: {"count": count, "cells": numbers} for what, (count, numbers) in defects.items()},
    }


def mean_of(values: Floats, over: Executor = serial) -> float:
    """The mean of the values of all processes, the same in any order; nan where there are none, or one is not finite.

    Each is rounded to 2⁻⁵² of the largest one, and they are added up as whole numbers, of two halves.
    """
    top, bad = float(np.abs(values).max(initial=0.0)), not bool(np.isfinite(values).all())
    top, count = -over.minimum(-top), int(over.total(np.array([len(values)]))[0])
    if int(over.total(np.array([int(bad)]))[0]) or not count:
        return math.nan
    scale, sums = math.frexp(top)[1], np.zeros(2, dtype=np.int64)
    for first in range(0, len(values), CHUNK):
        scaled = np.ldexp(values[first : first + CHUNK], -scale)  # up to 1
        high = np.rint(scaled * 2.0**HALF)
        low = np.rint((scaled - high * 2.0**-HALF) * 2.0 ** (2 * HALF))
        sums += int(high.sum()), int(low.sum())  # exact: of so few
    sums = over.total(sums)
    return math.ldexp((int(sums[0]) * 2**HALF + int(sums[1])) / (count * 2 ** (2 * HALF)), scale)


def percentile(values: Floats, percent: int, over: Executor = serial) -> float:
    """The percentile of the values of all processes, between two of them where it falls there."""
    place = percent / 100 * (int(over.total(np.array([len(values)]))[0]) - 1)
    below = int(place)
    low = over.nth(values, below + 1)
    return low if place == below else low + (over.nth(values, below + 2) - low) * (place - below)

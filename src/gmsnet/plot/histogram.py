"""Distributions of a measure over the cells of one or two meshes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from gmsnet.plot.view import View

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def histogram(axes: Axes, views: Sequence[View], name: str, label: str) -> None:
    """The share of cells by a measure (an array of QualityReport, by name), and a mark at the minimum value.

    The axis goes to the best value there is: for ``min_angle`` 60 degrees, or 90 where there are quads, and 1 else.
    Below 0 if cells are inverted.
    """
    values = [getattr(view.report, name) for view in views]
    low = min([0.0, *(float(v.min()) for v in values)])
    best = 1.0
    if name == "min_angle":
        best = 90.0 if any(view.corners.shape[1] == 4 for view in views) else 60.0
    bins = np.linspace(low, best, 61).tolist()
    for view, each in zip(views, values, strict=True):
        share = np.full(len(each), 100.0 / len(each))
        axes.hist(each, bins, weights=share, color=view.colour, alpha=0.35, edgecolor="none")
        axes.hist(each, bins, weights=share, color=view.colour, histtype="step", linewidth=1.4, label=view.title)
        axes.plot(each.min(), 0.0, marker="v", color=view.colour, markersize=7, clip_on=False, zorder=3)
    axes.set_xlabel(f"{label}; ▾ the minimum")
    axes.set_ylabel("share of cells (%)")
    axes.set_xlim(bins[0], bins[-1])
    axes.spines[["top", "right"]].set_visible(False)
    if len(views) > 1:
        axes.legend(loc="upper left", frameon=False)

"""Distributions of a measure over the cells of one or two meshes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np

from gmsnet.measure.bins import bins_of
from gmsnet.measure.report import QualityReport

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class Shown(Protocol):
    """One mesh of a picture: what its histograms are made of."""

    @property
    def title(self) -> str:
        """Before or after."""
        ...

    @property
    def colour(self) -> str:
        """Of its histograms."""
        ...

    @property
    def quads(self) -> bool:
        """Are its bins those of cells that may be quads, or of volumes?"""
        ...

    @property
    def report(self) -> QualityReport:
        """Its measures."""
        ...


def histogram(axes: Axes, views: Sequence[Shown], name: str, label: str) -> None:
    """The share of cells by a measure (an array of QualityReport, by name), and a mark at the worst value."""
    values, worst = [view.report.column(name) for view in views], np.max if name == "max_dihedral" else np.min
    bins = bins_of(name, values, quads=any(view.quads for view in views)).tolist()
    for view, each in zip(views, values, strict=True):
        share = np.full(len(each), 100.0 / len(each))
        axes.hist(each, bins, weights=share, color=view.colour, alpha=0.35, edgecolor="none")
        axes.hist(each, bins, weights=share, color=view.colour, histtype="step", linewidth=1.4, label=view.title)
        axes.plot(worst(each), 0.0, marker="v", color=view.colour, markersize=7, clip_on=False, zorder=3)
    axes.set_xlabel(f"{label}; ▾ {'max' if name == 'max_dihedral' else 'min'}")
    axes.set_ylabel("share of cells (%)")
    axes.set_xlim(bins[0], bins[-1])
    axes.spines[["top", "right"]].set_visible(False)
    if len(views) > 1:
        axes.legend(loc="upper right" if name == "max_dihedral" else "upper left", frameon=False)

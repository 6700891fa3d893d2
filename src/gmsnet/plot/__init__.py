"""Pictures of meshes and their quality: cells from blue (good) to yellow (bad), inverted ones red, and histograms.

The only place that imports matplotlib, on use and without its global state, so no display is needed.
"""

from typing import TYPE_CHECKING

from gmsnet.measure.palette import AFTER, BEFORE
from gmsnet.plot.figure import check_target, new_figure, png_bytes
from gmsnet.plot.histogram import histogram
from gmsnet.plot.smoothing import plot_quality, plot_smoothing
from gmsnet.plot.view import View, add_colour_bar, check_mesh, draw
from gmsnet.plot.zoom import frame, surroundings

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Figure

__all__ = [
    "AFTER",
    "BEFORE",
    "View",
    "add_colour_bar",
    "check_mesh",
    "check_target",
    "draw",
    "frame",
    "histogram",
    "new_figure",
    "plot_quality",
    "plot_smoothing",
    "png_bytes",
    "surroundings",
]

"""The surroundings of the worst cell, and where they lie in the whole."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gmsnet.plot.view import View

if TYPE_CHECKING:
    from matplotlib.axes import Axes

RING_BELOW = 0.03  # of the picture; a frame smaller than this cannot be seen


def surroundings(view: View, cells: int) -> NDArray[np.float64]:
    """(2 × 2) a square around the worst cell in which about as many cells are seen."""
    corners = view.points[view.corners]
    centres = corners.mean(axis=1)
    worst = int(view.report.worst(1)[0])
    distance = np.abs(centres - centres[worst]).max(axis=1)
    near = np.partition(distance, min(cells, len(distance) - 1))[: cells + 1].max()
    half = max(float(near), 1.2 * float(np.abs(corners[worst] - centres[worst]).max()))
    low, high = view.box  # at the rim of the mesh the square moves inwards, so that it shows cells
    centre = np.where(high - low > 2 * half, np.clip(centres[worst], low + half, high - half), (low + high) / 2)
    reach = np.minimum(half, (high - low) / 2)
    return np.stack([centre - reach, centre + reach])


def frame(axes: Axes, window: NDArray[np.float64]) -> None:
    """Marks on the whole picture where the zoom is; a frame too small to be seen gets a ring around it."""
    from matplotlib.patches import Rectangle

    width, height = window[1] - window[0]
    for colour, thick in (("white", 3.0), ("black", 1.3)):
        axes.add_patch(Rectangle(tuple(window[0]), width, height, fill=False, edgecolor=colour, linewidth=thick))
        if max(width, height) < RING_BELOW * max(np.ptp(axes.get_xlim()), np.ptp(axes.get_ylim())):
            axes.plot(*window.mean(axis=0), "o", ms=18, mfc="none", mec=colour, mew=thick, clip_on=False)

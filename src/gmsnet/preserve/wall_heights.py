"""How high cells along walls have become, where they had one height: nobody gets such rows by chance."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gmsnet.preserve.courses import spread
from gmsnet.preserve.wall_edges import Beside, doubled
from gmsnet.topology.stars import Ints

Floats = NDArray[np.float64]

FEWEST = 12  # edges of a wall of which it is told how high cells are now
HIGHER = math.log(1.3)  # than before, in the median of the cells on a wall: less is not told
ONE_HEIGHT = math.log(1.25)  # between most heights along a wall: nobody gets them by chance
TINY = 1e-300


def height_note(beside: Beside, before: Floats, now: Floats) -> list[str]:
    """Says so where cells of one height along a wall have another now. before, now: (N, 2) points, by places."""
    times = heights_now(beside, before, now)
    changed = times[np.abs(np.log(times)) > HIGHER]
    if not len(changed):
        return []
    most = changed[np.argmax(np.abs(np.log(changed)))]
    which = "a wall" if len(changed) == 1 else f"{len(changed)} walls"
    mend = "if they are meant, preserve='size' changes them less, and nodes that fix names stay"
    return [f"cells that have one height over {which} are {most:.2g} times as high now, in the median: {mend}"]


def heights_now(beside: Beside, before: Floats, now: Floats) -> Floats:
    """How many times as high as before cells are over the edges of a wall, in the median, for each wall along which
    they had one height, or one ratio of height and length, and that has FEWEST edges or more.

    before, now: (N, 2) points by places in memory. No wall is looked at where the areas of few cells have changed by
    more than HIGHER, or where those of three quarters are uneven.
    """
    found, rows = list[float](), beside.simplices.rows
    first, last = (np.log(doubled(each, rows) + TINY) for each in (before, now))
    if np.count_nonzero(np.abs(last - first) > HIGHER) < FEWEST // 2:  # so it is with most meshes
        return np.array(found)
    steps = np.sort(np.abs(np.diff(first)))  # cells that lie near one another stand so in memory
    if steps[len(steps) // 4] > ONE_HEIGHT:  # so it is with random ones
        return np.array(found)
    for edges, cells in beside.walls():
        if len(edges) < FEWEST:
            continue
        first, length = _log_heights(before, rows[cells], edges)
        if min(spread(first), spread(first - length)) <= ONE_HEIGHT:
            last, _ = _log_heights(now, rows[cells], edges)
            found.append(float(np.exp(np.median(last - first))))
    return np.array(found)


def _log_heights(points: Floats, triangles: Ints, edges: Ints) -> tuple[Floats, Floats]:
    """Logarithms of the heights of cells over edges, and of their lengths."""
    way = points[edges[:, 1]] - points[edges[:, 0]]
    length = np.log(np.hypot(way[:, 0], way[:, 1]) + TINY)
    return np.log(doubled(points, triangles) + TINY) - length, length

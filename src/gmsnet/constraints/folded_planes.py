"""Plane parts of a surface whose cells lie over one another, as in a plane mesh that is tangled and turned in space.

Where such cells meet, their normals are opposite. So every fold looks like a sharp edge, whose nodes would be held.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.charts import Chart, across_edges, axes_across, crossed, edges_of, level, normals_of
from gmsnet.constraints.facets import Facets
from gmsnet.constraints.features import dot
from gmsnet.constraints.outline import Flags, Longs
from gmsnet.constraints.patches import linked
from gmsnet.kernels.topology.sorted_unique import sorted_unique

Floats = NDArray[np.float64]
LEVEL = 1e-6  # of the length of edges, and of the extent of the part: what is so near to a plane is in it

FEWEST = 3  # facets around a node that is inside of its part


def folded_planes(facets: Facets, points: Floats) -> list[Chart]:
    """The parts with a boundary of their own that lie in a plane and are folded in it. points: (N, 3).

    A part hangs together across edges of two facets of one label, where there is no line cell.
    """
    rows = facets.rows
    normal, unit, area = normals_of(points, rows)
    edges = edges_of(len(points), rows)
    joined = level(facets, points, unit, area, edges, LEVEL)
    part = linked(across_edges(len(rows), *edges[2:, joined]))
    found = _with_folds(facets, points, part, unit)
    planes = (_plane(np.flatnonzero(part == number), points, rows, normal) for number in found)
    return [plane for plane in planes if plane is not None]


def _with_folds(facets: Facets, points: Floats, part: Longs, unit: Floats) -> list[int]:
    """The parts with facets on both sides, or with a quad that has corners on both, and with nodes inside."""
    count = int(part.max(initial=-1)) + 1
    first = np.full(count, len(part), dtype=np.int64)
    np.minimum.at(first, part, np.arange(len(part)))
    over = np.zeros(count, dtype=bool)
    over[part[dot(unit, unit[first[part]]) < 0.0]] = True
    begin, half = len(part) - facets.halves, facets.halves // 2
    over[part[begin : begin + half][crossed(facets, points)]] = True
    return np.flatnonzero(over & _with_inner_nodes(facets.rows, part, count)).tolist()


def _with_inner_nodes(rows: Longs, part: Longs, count: int) -> Flags:
    """(count,) which parts have nodes that none but their facets have, which alone may move: FEWEST facets at least."""
    size = int(rows.max(initial=-1)) + 1
    low, high = np.full(size, count, dtype=np.int64), np.full(size, -1, dtype=np.int64)
    for column in rows.T:
        np.minimum.at(low, column, part)
        np.maximum.at(high, column, part)
    found = np.zeros(count, dtype=bool)
    found[low[(low == high) & (np.bincount(rows.ravel(), minlength=size) >= FEWEST)]] = True
    return found


def _plane(chosen: Longs, points: Floats, rows: Longs, normal: Floats) -> Chart | None:
    """The plane of a part; None where it is none, or has no boundary, and so no side that is up."""
    nodes = sorted_unique(rows[chosen])
    at = points[nodes]
    upward, size = normal[chosen].sum(axis=0), np.ptp(at, axis=0)
    extent = float(size.max())
    if not np.linalg.norm(upward) > LEVEL * extent**2:
        return None
    upward = upward / np.linalg.norm(upward)
    flat = int(np.argmax(abs(upward)))
    if size[flat] == 0.0:
        axes = np.eye(3)[[(flat + 1) % 3, (flat + 2) % 3]]
        axes = axes if upward[flat] > 0.0 else axes[::-1]
    else:
        axes = axes_across(upward)
    off = (at - at[0]) @ np.cross(axes[0], axes[1])
    return Chart(chosen, at[0], axes) if abs(off).max() <= LEVEL * extent else None

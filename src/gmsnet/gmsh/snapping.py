"""Nodes that have slid, put onto Gmsh's curves themselves: the arcs that they slide on pass within 1e-5 of an edge."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from gmsnet.gmsh.curve import CadCurve
from gmsnet.gmsh.live import Live
from gmsnet.measure.report import measure
from gmsnet.measure.target import Target
from gmsnet.run.result import SmoothResult

KEPT = "slide: the nodes stay on arcs close to Gmsh's curves, as cells would become worse on the curves themselves"


def on_curves(live: Live, curves: Mapping[int, CadCurve], result: SmoothResult, target: Target) -> SmoothResult:
    """The same result with the moved nodes of curves, by their tags, on these, in all their digits.

    It is taken if no more cells are inverted or miss the target, and the worst one is no worse than in the input;
    else a note says so. The move is judged by exact signs of the cells as they are then.
    """
    points, axes = result.points.copy(), list(live.mesh.plane or (0, 1))
    for part in live.parts:
        if part.dimension == 1 and part.tag in curves:
            rows = part.first + np.flatnonzero(result.moved[part.first : part.last])
            if len(rows):
                points[rows[:, None], axes] = curves[part.tag].project(points[rows])[0][:, axes]
    if np.array_equal(points, result.points):
        return result
    mesh = live.mesh.with_points(points)
    before, arcs, found = result.before, result.after, measure(mesh, result.topology)
    worse = (
        found.inverted > arcs.inverted
        or (not before.inverted and found.shape.min() < min(before.shape.min(), arcs.shape.min()))
        or target.missed(found.shape, found.min_angle).sum() > target.missed(arcs.shape, arcs.min_angle).sum()
    )
    if worse:
        return replace(result, notes=[*result.notes, KEPT])
    moved = (points != live.mesh.points).any(axis=1)
    return replace(result, mesh=mesh, points=points, after=found, moved=moved)

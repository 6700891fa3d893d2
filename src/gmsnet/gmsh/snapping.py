"""Nodes that have slid, put onto Gmsh's geometry: the arcs and patches that they slide on only pass close to it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.gmsh.curve import CadCurve
from gmsnet.gmsh.live import Live, Part
from gmsnet.measure.report import QualityReport, measure
from gmsnet.measure.target import Target
from gmsnet.run.smooth_result import SmoothResult

Floats = NDArray[np.float64]
KEPT = "slide: the nodes stay close to Gmsh's geometry, as cells would become worse on it"
FLAT = "Plane"  # a type of surface: nodes that slide in a plane are on it


def on_geometry(
    gmsh: Any, live: Live, curves: Mapping[int, CadCurve], result: SmoothResult, target: Target
) -> SmoothResult:
    """The same result with its moved nodes of curves and surfaces on these, in all their digits.

    It is taken if no more cells are inverted or miss the target, and the worst one is no worse than in the input;
    else a note says so. The move is judged by the exact signs of the cells as they are then.
    """
    points = _snapped(gmsh, live, curves, result)
    if np.array_equal(points, result.points):
        return result
    mesh = live.mesh.with_points(points)
    found = measure(mesh, result.topology)
    if _is_worse(found, result, target):
        return replace(result, notes=[*result.notes, KEPT])
    moved = (points != live.mesh.points).any(axis=1)
    return replace(result, mesh=mesh, points=points, after=found, moved=moved)


def _snapped(gmsh: Any, live: Live, curves: Mapping[int, CadCurve], result: SmoothResult) -> Floats:
    points = result.points.copy()
    axes = list(live.mesh.plane if live.planar and live.mesh.plane else (0, 1, 2))
    for part in live.parts:
        rows = part.first + np.flatnonzero(result.moved[part.first : part.last])
        if len(rows) and part.dimension == 1 and part.tag in curves:
            points[rows[:, None], axes] = curves[part.tag].project(points[rows])[0][:, axes]
        elif len(rows) and not live.planar and _is_curved(gmsh, part):
            places, _ = gmsh.model.getClosestPoint(2, part.tag, points[rows].ravel())
            points[rows] = np.asarray(places).reshape(-1, 3)
    return points


def _is_curved(gmsh: Any, part: Part) -> bool:
    return part.dimension == 2 and not part.discrete and gmsh.model.getType(2, part.tag) != FLAT


def _is_worse(found: QualityReport, result: SmoothResult, target: Target) -> bool:
    before, near = result.before, result.after
    least = min(before.shape.min(initial=np.inf), near.shape.min(initial=np.inf))
    if found.inverted > near.inverted or (not before.inverted and found.shape.min(initial=np.inf) < least):
        return True
    return bool(target) and _missed(target, found) > _missed(target, near)


def _missed(target: Target, report: QualityReport) -> int:
    return int(target.missed(report.shape, report.column(report.angles[0])).sum())

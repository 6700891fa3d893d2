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
from gmsnet.mesh.display import amount
from gmsnet.mesh.mesh import Mesh
from gmsnet.run.smooth_result import SmoothResult

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
KEPT = "as cells would become worse on it"
FLAT = "Plane"  # a type of surface: nodes that slide in a plane are on it


def on_geometry(
    gmsh: Any, live: Live, curves: Mapping[int, CadCurve], result: SmoothResult, target: Target
) -> SmoothResult:
    """The same result with its moved nodes of curves and surfaces on these, in all their digits.

    Nodes stay where they are at cells that would be inverted, miss the target, or be worse than the worst one of the
    input; a note says how many. The move is judged by the exact signs of the cells as they are then.
    """
    points = _snapped(gmsh, live, curves, result)
    wanted, moving = np.linalg.norm(points - result.points, axis=1), (points != result.points).any(axis=1)
    while moving.any():
        points = np.where(moving[:, None], points, result.points)
        mesh = live.mesh.with_points(points)
        found = measure(mesh, result.topology)
        if not _is_worse(found, result, target):
            break
        back = moving & _nodes_of(mesh, found.cell[_suffering(found, result, target)])
        moving &= ~back if back.any() else False
    kept = wanted[(wanted > 0.0) & ~moving]
    notes = [*result.notes]
    if len(kept):
        notes.append(
            f"slide: {amount(len(kept), 'node')} of Gmsh's geometry {'stay' if len(kept) > 1 else 'stays'} "
            f"close to it, at most {kept.max():.2g} away, {KEPT}"
        )
    if not moving.any():
        return replace(result, notes=notes)
    moved = (points != live.mesh.points).any(axis=1)
    return replace(result, mesh=mesh, points=points, after=found, moved=moved, notes=notes)


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
    if found.inverted > result.after.inverted or (_below(found, result).any() and not result.before.inverted):
        return True
    return int(_missed(target, found).sum()) > int(_missed(target, result.after).sum())


def _suffering(found: QualityReport, result: SmoothResult, target: Target) -> Flags:
    """(T,) the cells for which nodes go back."""
    suffering = (~found.valid & result.after.valid) | (_missed(target, found) & ~_missed(target, result.after))
    return suffering if result.before.inverted else suffering | _below(found, result)


def _below(found: QualityReport, result: SmoothResult) -> Flags:
    """(T,) the cells that are worse than the worst one of the input, and of the result."""
    least = min(result.before.shape.min(initial=np.inf), result.after.shape.min(initial=np.inf))
    below: Flags = found.shape < least
    return below


def _missed(target: Target, report: QualityReport) -> Flags:
    return target.missed(report.shape, report.column(report.angles[0]))


def _nodes_of(mesh: Mesh, cells: NDArray[np.int64]) -> Flags:
    """(N,) the nodes of cells, by their numbers among all of the mesh."""
    found, first = np.zeros(len(mesh.points), dtype=bool), 0
    for block in mesh.cells:
        last = first + len(block.nodes)
        found[block.nodes[cells[(cells >= first) & (cells < last)] - first]] = True
        first = last
    return found

"""Whether a tool did what it was meant to do: other places for inner nodes, and nothing else."""

from __future__ import annotations

import numpy as np

from peers.peer import Plane

HELD, ROUNDED, DRIFTS, SLIDES, LOST = "held", "held, rounded", "drifts", "slides along the sides", "moves"
ROUNDING = 1e-7  # of coordinates up to 1 in single precision
DRIFT = 1e-2  # in mean edges: farther away a node counts as moved


def behaviour(plane: Plane, points: np.ndarray, cells: np.ndarray | None) -> dict[str, object]:
    """What a tool did to the mesh, from where its nodes are now, (N, 2) or (N, 3), and its cells.

    points_kept: as many as before, all finite, in the plane z = 0. cells_kept: the same triangles in the same order, or
    None for a tool without cells of its own. moved: share of the inner nodes that are elsewhere. boundary: one of the
    words above. boundary_shift: the longest way of a node on the boundary, in sides of the square.
    """
    found: dict[str, object] = {
        "points_kept": points.shape[0] == len(plane.points) and bool(np.isfinite(points).all())
        and (points.shape[1] == 2 or not points[:, 2].any()),
        "cells_kept": None if cells is None else np.array_equal(cells, plane.cells),
    }  # fmt: skip
    if not found["points_kept"]:
        return found
    shift = points[:, :2] - plane.points
    far = np.abs(shift).max(axis=1)
    found["moved"] = float((far[~plane.held] > 0.0).mean())
    found["boundary_shift"] = float(np.hypot(*shift[plane.held].T).max())
    found["boundary"] = boundary(plane, shift)
    return found


def boundary(plane: Plane, shift: np.ndarray) -> str:
    """What the nodes of the unit square's sides did, in a word. shift: (N, 2)."""
    longest = float(np.hypot(*shift[plane.held].T).max())
    if longest == 0.0:
        return HELD
    if longest <= ROUNDING:
        return ROUNDED
    across = max(
        float(np.abs(shift[plane.points[:, axis] == side, axis]).max()) for axis in (0, 1) for side in (0.0, 1.0)
    )
    if across <= ROUNDING:
        return SLIDES
    tail, head = plane.edges
    edge = float(np.hypot(*(plane.points[head] - plane.points[tail]).T).mean())
    return DRIFTS if longest <= DRIFT * edge else LOST


def figures(points: np.ndarray, cells: np.ndarray) -> dict[str, float]:
    """What gmsnet measures of a mesh: mean and least 1/q, q̂, cells that are not positive, least and largest angle."""
    import gmsnet  # not before the memory of the tool has been looked at

    report = gmsnet.quality((np.ascontiguousarray(points[:, :2], dtype=np.float64), cells))
    return {
        "mean": float(report.shape.mean()),
        "min": float(report.shape.min()),
        "qhat": report.qhat,
        "inverted": report.inverted,
        "min_angle": float(report.min_angle.min()),
        "max_angle": float(report.max_angle.max()),
    }

"""What a page draws, as arrays: nodes before and after, cells, their measures, held nodes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.measure.bins import ENDS
from gmsnet.measure.palette import BAD_TO_GOOD, INVERTED, OTHER_CELLS
from gmsnet.measure.report import QualityReport
from gmsnet.mesh.mesh import Mesh
from gmsnet.page.contents import Contents
from gmsnet.page.groups import MOST_FACETS, Group, groups_of, shell_of

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

MOST_CELLS = 1_500_000  # are drawn all
FEW_CELLS = 300_000  # are drawn of a mesh of more: those at the boundary and those nearest to the worst ones
FINE = 1e-4  # of half of the extent: a shorter edge needs coordinates of more than single precision
UNKNOWN = np.iinfo(np.int16).min  # the measure of a cell that has none
STEPS = {"shape": 1000, "angle": 10}  # of one: to so many parts measures are kept
DISPLACED = ["#eef1f4", "#8e6bb0", "#3b0a54"]  # from nothing to the greatest displacement


class Scene(NamedTuple):
    """known: plain values. arrays: by name. remark: what is not shown, "" if all is."""

    known: dict[str, Any]
    arrays: dict[str, NDArray[Any]]
    remark: str


def scene_of(contents: Contents) -> Scene | None:
    """What is drawn; None where there is no cell that could be."""
    mesh, after = contents.mesh, contents.after
    states = [report.cells.points for report in contents.reports.values()]
    groups, left_out = groups_of(mesh)
    if not groups:
        return None
    total = sum(len(group.nodes) for group in groups)
    remarks = [f"Not drawn: {left_out}, whose shape is not known."] if left_out else []
    shell = shell_of(groups, len(mesh.points)) if mesh.has_volumes else None
    if total > MOST_CELLS:
        groups, shell = _few(groups, shell, states[-1], _seeds(contents))
        drawn = sum(len(group.nodes) for group in groups)
        where = "at the boundary and around the worst ones" if mesh.has_volumes else "around the worst ones"
        remarks.append(
            f"The mesh has {total:,} cells, more than {MOST_CELLS:,}: the picture shows {drawn:,} of them, {where}. "
            "All figures are of the whole mesh."
        )
    axes = [0, 1, 2] if mesh.plane is None or mesh.has_volumes else list(mesh.plane)
    used = _used(mesh, groups)
    number = np.cumsum(used) - 1
    low, high = _box([points[used][:, axes] for points in states])
    middle, half = 0.5 * low + 0.5 * high, float((0.5 * high - 0.5 * low).max()) or 1.0
    arrays: dict[str, NDArray[Any]] = {}
    fine = _shortest(groups, states[0], axes) < FINE * half
    base: list[NDArray[np.uint32]] = []
    for state, points in zip(contents.reports, states, strict=True):
        exact = (points[used][:, axes] - middle) / half
        parts = [exact.astype(np.float32)]
        if fine:
            parts.append((exact - parts[0]).astype(np.float32))
        bits = [np.ascontiguousarray(part.T).view(np.uint32) for part in parts]
        names = [state, f"{state}Low"][: len(bits)]
        if not base:
            base = bits
            arrays |= {name: part.view(np.float32) for name, part in zip(names, bits, strict=True)}
        else:  # of nodes that have not moved all bits are zero
            changed = [one ^ other for one, other in zip(bits, base, strict=True)]
            arrays |= {name: part.view(np.float32) for name, part in zip(names, changed, strict=True)}
    arrays["corners"] = np.concatenate([number[group.nodes].T.ravel() for group in groups]).astype(np.uint32)
    cells = np.concatenate([group.number for group in groups])
    if not np.array_equal(cells, np.arange(len(cells))):
        arrays["numbers"] = cells.astype(np.uint32)
    if shell is not None:
        arrays["shell"] = shell
    lines = [number[block.nodes[:, :2]] for block in mesh.cells if block.dimension == 1]
    arrays["lines"] = np.concatenate([np.empty((0, 2), dtype=np.int64), *lines]).astype(np.uint32)
    arrays["held"] = _reasons(contents, len(mesh.points))[used]
    for state, report in contents.reports.items():
        arrays |= _measures(state, report, cells)
    angle = after.angles[0]
    known = {
        "dimension": len(axes), "volumes": mesh.has_volumes, "nodes": int(used.sum()), "cells": len(cells),
        "states": list(contents.reports), "middle": middle.tolist(), "half": half, "fine": bool(fine),
        "axes": ["xyz"[k] for k in axes], "symbol": after.symbol, "reasons": list(contents.held),
        "steps": STEPS, "unknown": UNKNOWN, "facets": MOST_FACETS,
        "greatest_angle": ENDS[angle][1] if angle in ENDS else 90.0 if contents.quads else 60.0,
        "angle": angle.replace("_", " ") + (" angle" if angle.endswith("dihedral") else ""),
        "colours": {"good": BAD_TO_GOOD, "inverted": INVERTED, "other": OTHER_CELLS, "moved": DISPLACED},
        "groups": [
            {"kind": g.kind, "count": len(g.nodes), "corners": g.nodes.shape[1], "facets": g.facets, "edges": g.edges}
            for g in groups
        ],
    }  # fmt: skip
    return Scene(known, arrays, " ".join(remarks))


def _measures(state: str, report: QualityReport, cells: Ints) -> dict[str, NDArray[Any]]:
    """Of the cells that are drawn: 1/q and the smallest angle, rounded, and which are inverted."""
    every = int(max(cells.max(), report.cell.max(initial=0))) + 1
    row = np.full(every, -1)
    row[report.cell] = np.arange(len(report.cell))
    row = row[cells]
    measured = row >= 0
    made: dict[str, NDArray[Any]] = {}
    for name, column in (("shape", "shape"), ("angle", report.angles[0])):
        rounded = np.full(len(cells), UNKNOWN, dtype=np.int16)
        if measured.any():
            rounded[measured] = np.rint(report.column(column)[row[measured]] * STEPS[name])
        made[f"{name}-{state}"] = rounded
    invalid = measured.copy()
    invalid[measured] = ~report.valid[row[measured]]
    made[f"invalid-{state}"] = np.flatnonzero(invalid).astype(np.uint32)
    return made


def _reasons(contents: Contents, nodes: int) -> NDArray[np.uint8]:
    """(N,) 0 for free nodes, else 1 and more in the order of the reasons."""
    found = np.zeros(nodes, dtype=np.uint8)
    for k, ids in enumerate(contents.held.values(), start=1):
        found[ids] = k
    return found


def _used(mesh: Mesh, groups: Sequence[Group]) -> NDArray[np.bool_]:
    """(N,) which nodes are drawn."""
    used = np.zeros(len(mesh.points), dtype=bool)
    for group in groups:
        used[group.nodes.ravel()] = True
    for block in mesh.cells:
        if block.dimension == 1:
            used[block.nodes[:, :2].ravel()] = True
    return used


def _box(states: Sequence[Floats]) -> tuple[Floats, Floats]:
    low = np.min([points.min(axis=0) for points in states], axis=0)
    return low, np.max([points.max(axis=0) for points in states], axis=0)


def _shortest(groups: Sequence[Group], points: Floats, axes: Sequence[int]) -> float:
    """The length of the shortest edge that is not zero, by its greatest coordinate."""
    least = np.inf
    for group in groups:
        for a, b in group.edges:
            ends = [points[group.nodes[:, node]] for node in (a, b)]
            lengths = np.max([np.abs(ends[1][:, k] - ends[0][:, k]) for k in axes], axis=0)
            least = min(least, float(lengths.min(initial=np.inf, where=lengths > 0.0)))
    return least


def _seeds(contents: Contents) -> Ints:
    """The numbers of the cells that must be seen."""
    named = [int(cell["cell"]) for cell in (*contents.worst_after, *contents.worst_before)]
    return np.array([*named, *(cell for cell, _ in contents.unmended)], dtype=np.int64)


def _few(
    groups: Sequence[Group], shell: NDArray[np.uint32] | None, points: Floats, seeds: Ints
) -> tuple[list[Group], NDArray[np.uint32] | None]:
    """The cells nearest to the seeds, and those at the boundary of volumes."""
    centres = np.concatenate([np.mean([points[corner] for corner in group.nodes.T], axis=0) for group in groups])
    numbers = np.concatenate([group.number for group in groups])
    distance = np.full(len(centres), np.inf)
    for centre in centres[np.isin(numbers, seeds)]:
        np.minimum(distance, ((centres - centre) ** 2).sum(axis=1), out=distance)
    if shell is not None:
        distance[shell // MOST_FACETS] = -1.0
    most = max(FEW_CELLS, int(np.count_nonzero(distance < 0.0)))
    chosen = np.zeros(len(centres), dtype=bool)
    chosen[np.argpartition(distance, min(most, len(distance) - 1))[:most]] = True
    parts = np.split(chosen, np.cumsum([len(group.nodes) for group in groups])[:-1])
    kept = [group.taken(part) for group, part in zip(groups, parts, strict=True) if part.any()]
    if shell is not None:
        place = (np.cumsum(chosen) - 1).astype(np.uint32)
        shell = place[shell // MOST_FACETS] * np.uint32(MOST_FACETS) + shell % MOST_FACETS
    return kept, shell

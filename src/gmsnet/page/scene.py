"""What a page draws, as arrays: nodes before and after, cells, their measures, held nodes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.measure.bins import ENDS
from gmsnet.measure.palette import BAD_TO_GOOD, INVERTED, OTHER_CELLS
from gmsnet.mesh.mesh import Mesh
from gmsnet.page.contents import Contents
from gmsnet.page.groups import MOST_FACETS, Group, groups_of, shell_of
from gmsnet.page.measures import STEPS, UNKNOWN, measures_of, reasons_of
from gmsnet.page.places import SINGLE, bits_for, box_of, drawn_nodes, places_of, shortest_edge
from gmsnet.page.selection import MOST_CELLS, few_of, seeds_of

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

DISPLACED = ["#eef1f4", "#8e6bb0", "#3b0a54"]  # from nothing to the greatest displacement


class Scene(NamedTuple):
    """known: plain values. arrays: by name. remark: what is not shown, "" if all is."""

    known: dict[str, Any]
    arrays: dict[str, NDArray[Any]]
    remark: str


def scene_of(contents: Contents) -> Scene | None:
    """What is drawn; None where there is no cell that could be."""
    mesh = contents.mesh
    groups, left_out = groups_of(mesh)
    if not groups:
        return None
    points = {state: report.cells.points for state, report in contents.reports.items()}
    shell = shell_of(groups, len(mesh.points)) if mesh.has_volumes else None
    remarks = [f"Not drawn: {left_out}, whose shape is not known."] if left_out else []
    total = sum(len(group.nodes) for group in groups)
    if total > MOST_CELLS:
        groups, shell = few_of(groups, shell, contents.after.cells.points, seeds_of(contents))
        remarks.append(_less(total, sum(len(group.nodes) for group in groups), mesh.has_volumes))
    axes = [0, 1, 2] if mesh.plane is None or mesh.has_volumes else list(mesh.plane)
    ids = drawn_nodes(mesh, groups)
    drawn = {state: each[ids][:, axes] for state, each in points.items()}
    low, high = box_of(list(drawn.values()))
    middle, half = 0.5 * low + 0.5 * high, float((0.5 * high - 0.5 * low).max()) or 1.0
    bits = bits_for(min(shortest_edge(groups, each, axes) for each in points.values()) / half)
    arrays = places_of({state: (each - middle) / half for state, each in drawn.items()}, bits)
    arrays |= _cells(mesh, groups, ids)
    if shell is not None:
        arrays["shell"] = shell
    arrays["held"] = reasons_of(contents, len(mesh.points))[ids]
    cells = np.concatenate([group.number for group in groups])
    for state, report in contents.reports.items():
        arrays |= measures_of(state, report, cells)
    place = {
        "dimension": len(axes), "axes": ["xyz"[k] for k in axes], "nodes": len(ids), "middle": middle.tolist(),
        "half": half, "fine": bits > SINGLE,
    }  # fmt: skip
    return Scene(_known(contents, groups) | place, arrays, " ".join(remarks))


def _less(total: int, drawn: int, volumes: bool) -> str:
    where = "at the boundary and around the worst ones" if volumes else "around the worst ones"
    return (
        f"The mesh has {total:,} cells, more than {MOST_CELLS:,}: the picture shows {drawn:,} of them, {where}. "
        "All figures are of the whole mesh."
    )


def _cells(mesh: Mesh, groups: Sequence[Group], ids: Ints) -> dict[str, NDArray[Any]]:
    """The corners of all cells, group by group and corner by corner; their numbers, unless 0, 1, 2, …; lines."""
    number = np.empty(len(mesh.points), dtype=np.int64)
    number[ids] = np.arange(len(ids))
    lines = [number[block.nodes[:, :2]] for block in mesh.cells if block.dimension == 1]
    made = {
        "corners": np.concatenate([number[group.nodes].T.ravel() for group in groups]).astype(np.uint32),
        "lines": np.concatenate([np.empty((0, 2), dtype=np.int64), *lines]).astype(np.uint32),
    }
    cells = np.concatenate([group.number for group in groups])
    if not np.array_equal(cells, np.arange(len(cells))):
        made["numbers"] = cells.astype(np.uint32)
    return made


def _known(contents: Contents, groups: Sequence[Group]) -> dict[str, Any]:
    """What is no array."""
    after = contents.after
    angle = after.angles[0]
    return {
        "volumes": contents.mesh.has_volumes, "cells": sum(len(group.nodes) for group in groups),
        "states": list(contents.reports), "symbol": after.symbol, "steps": STEPS, "unknown": UNKNOWN,
        "facets": MOST_FACETS, "angle": angle.replace("_", " ") + (" angle" if angle.endswith("dihedral") else ""),
        "greatest_angle": ENDS[angle][1] if angle in ENDS else 90.0 if contents.quads else 60.0,
        "colours": {"good": BAD_TO_GOOD, "inverted": INVERTED, "other": OTHER_CELLS, "moved": DISPLACED},
        "groups": [
            {"kind": g.kind, "count": len(g.nodes), "corners": g.nodes.shape[1], "facets": g.facets, "edges": g.edges}
            for g in groups
        ],
    }  # fmt: skip

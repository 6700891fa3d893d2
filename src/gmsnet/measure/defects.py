"""What is wrong with volume cells as a file gives them: what no move of a node, or hardly any, can mend."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import CELLS
from gmsnet.measure.solids import MeasuredSolids
from gmsnet.mesh.display import amount
from gmsnet.topology.ordering import space_points

Rows = NDArray[np.int64]

NAMED = 10  # cells are named
REPEATED = "cells with a node that stands in them twice"
FLAT = "cells without volume at any corner"
TURNED = "cells inside out at all corners"
UNMATCHED = "cells with four-sided faces that meet two triangles"
DEFECTS = REPEATED, FLAT, TURNED, UNMATCHED  # in the order in which they are told


def defects_of(cells: MeasuredSolids) -> dict[str, Rows]:
    """What is wrong → the indices of the cells among all cells of the mesh, where there are any."""
    none = np.empty(0, dtype=np.int64)
    found: dict[str, list[Rows]] = {REPEATED: [none], FLAT: [none], TURNED: [none], UNMATCHED: [_unmatched(cells)]}
    points = space_points(cells)
    for block in cells.blocks:
        kind = CELLS[block.kind]
        ordered = np.sort(block.nodes, axis=1)
        repeated = (ordered[:, 1:] == ordered[:, :-1]).any(axis=1)
        values = cells.at_corners(block)
        extent = points[block.nodes[:, : kind.corners], :3]
        size = np.ptp(extent, axis=1).max(axis=1) ** 3
        flat = (np.abs(values) <= 1e-12 * size[:, None]).all(axis=1) & ~repeated
        turned = (values <= 0.0).all(axis=1) & ~flat & ~repeated
        for what, chosen in ((REPEATED, repeated), (FLAT, flat), (TURNED, turned)):
            found[what].append(block.number[chosen])
    joined = {what: np.sort(np.concatenate(rows)) for what, rows in found.items()}
    return {what: rows for what, rows in joined.items() if len(rows)}


def remarks_on(cells: MeasuredSolids) -> list[str]:
    """The same in words, and which cells are read inside out."""
    said = [
        f"{amount(len(numbers), f'{kind} cell')} inside out in the file: read in the other order of their nodes"
        for kind, numbers in cells.turned.items()
    ]
    found = {what: (len(rows), rows[:NAMED].tolist()) for what, rows in defects_of(cells).items()}
    return [*said, *in_words(found)]


def in_words(defects: Mapping[str, tuple[int, list[int]]]) -> list[str]:
    """What is wrong, a sentence each. defects: how many cells, and the first of their numbers."""
    said = []
    for what, (count, numbers) in defects.items():
        named = ", ".join(map(str, numbers)) + (", …" if count > len(numbers) else "")
        said.append(f"{amount(count, 'cell')} {what.removeprefix('cells ')} (numbers from 0: {named})")
    return said


def _unmatched(cells: MeasuredSolids) -> Rows:
    """The cells with a quad that no other cell has, whose nodes make two triangles that no other cell has either."""
    faces: dict[int, tuple[list[Rows], list[Rows]]] = {3: ([], []), 4: ([], [])}
    for block in cells.blocks:
        kind = CELLS[block.kind]
        for facet in kind.facets:
            corners = [node for node in facet if node < (kind.corners or 0)]
            faces[len(corners)][0].append(np.sort(block.nodes[:, corners].astype(np.int64), axis=1))
            faces[len(corners)][1].append(block.number)
    if not faces[3][0] or not faces[4][0]:
        return np.empty(0, dtype=np.int64)
    quads, owners = _alone(*faces[4])
    triangles, _ = _alone(*faces[3])
    threes = np.concatenate([triangles, *(np.delete(quads, k, axis=1) for k in range(4))])
    _, group = np.unique(threes, axis=0, return_inverse=True)
    group = group.ravel()
    meets = np.isin(group[len(triangles) :], group[: len(triangles)]).reshape(4, -1).sum(axis=0)
    chosen: Rows = owners[meets >= 2]
    return chosen


def _alone(rows: list[Rows], owners: list[Rows]) -> tuple[Rows, Rows]:
    """The faces of one cell alone, and the cell."""
    every, owner = np.concatenate(rows), np.concatenate(owners)
    _, first, count = np.unique(every, axis=0, return_index=True, return_counts=True)
    chosen = first[count == 1]
    return every[chosen], owner[chosen]

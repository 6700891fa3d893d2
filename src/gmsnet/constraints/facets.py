"""The facets of a surface in space whose nodes may slide on it: the boundary of a mesh of tetrahedra."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.outline import Flags, Longs, line_cells, mark_sets
from gmsnet.mesh.mesh import Mesh
from gmsnet.topology.wound import Wound


@dataclass(frozen=True, eq=False)
class Facets:
    """Triangles of a surface.

    rows: (F, 3) node ids, counter-clockwise as seen from outside. label: (F,), equal for facets of the same region with
    the same marks; names: label → the names of the marks. lines: (L, 2) node ids, the ends of line cells; line_marks
    (L,). still: (N,) bool, nodes that stay whatever lies around them.
    """

    rows: Longs
    label: Longs
    names: tuple[tuple[str, ...], ...]
    lines: Longs
    line_marks: Longs
    still: Flags


def boundary_of(mesh: Mesh, wound: Wound) -> Facets:
    """The boundary of the tetrahedra of a mesh."""
    rows = wound.memory[wound.boundary].astype(np.int64)
    region = wound.region[wound.outer >> 2] if len(wound.region) else np.zeros(len(rows), dtype=np.int64)
    lines, line_marks, still = line_cells(mesh)
    marks, names = _marks(mesh, rows)
    table, label = np.unique(np.column_stack([region, marks]), axis=0, return_inverse=True)
    return Facets(rows, label.reshape(-1), tuple(names[row] for row in table[:, 1].tolist()), lines, line_marks, still)


def _marks(mesh: Mesh, rows: Longs) -> tuple[Longs, list[tuple[str, ...]]]:
    """The set of marks of each facet as a number, and the names behind each number (``mark_sets``)."""
    blocks = [block for block in mesh.cells if block.dimension == 2 and block.kind == "triangle" and len(block.nodes)]
    if not blocks:
        return np.zeros(len(rows), dtype=np.int64), [()]
    faces = np.sort(np.concatenate([block.nodes for block in blocks]), axis=1)
    marks = np.concatenate([block.regions for block in blocks])
    keys, which = np.unique(np.vstack([np.sort(rows, axis=1), faces]), axis=0, return_inverse=True)
    own, other = np.split(which.reshape(-1), [len(rows)])
    facet = np.full(len(keys), -1, dtype=np.int64)
    facet[own] = np.arange(len(rows))
    owner: NDArray[np.int64] = facet[other]
    return mark_sets(mesh, owner[owner >= 0], marks[owner >= 0], len(rows), 2)

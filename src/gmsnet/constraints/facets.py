"""The facets of a surface in space whose nodes may slide on it: the boundary of a mesh of tetrahedra."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gmsnet.constraints.outline import Flags, Longs, line_cells, mark_sets
from gmsnet.mesh.mesh import Mesh
from gmsnet.topology.solids import WoundSolids, halved
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


def boundary_of(mesh: Mesh, wound: Wound | WoundSolids) -> Facets:
    """The boundary of the volumes of a mesh; its quadrilaterals are halved."""
    rows = wound.memory[wound.boundary].astype(np.int64)
    region = wound.region[wound.boundary_cell] if len(wound.region) else np.zeros(len(rows), dtype=np.int64)
    lines, line_marks, still = line_cells(mesh)
    marks, names = _marks(mesh, rows, still, halves=isinstance(wound, WoundSolids))
    table, label = np.unique(np.column_stack([region, marks]), axis=0, return_inverse=True)
    return Facets(rows, label.reshape(-1), tuple(names[row] for row in table[:, 1].tolist()), lines, line_marks, still)


def _marks(mesh: Mesh, rows: Longs, still: Flags, *, halves: bool) -> tuple[Longs, list[tuple[str, ...]]]:
    """The set of marks of each facet as a number, and the names behind each number (``mark_sets``).

    Nodes of surface cells that are none of the facets become still. halves: quadrilaterals are two of them each.
    """
    faces, marks = [np.zeros((0, 3), dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
    for block in mesh.cells:
        if block.dimension == 2 and block.kind == "triangle":
            faces.append(block.nodes)
            marks.append(block.regions)
        elif block.kind == "quad" and halves:
            faces.append(halved(block.nodes))
            marks.append(np.repeat(block.regions, 2))
        elif block.dimension == 2:
            still[block.nodes] = True
    cells, numbers = np.concatenate(faces), np.concatenate(marks)
    which = facet_keys(np.concatenate([rows, cells]), len(mesh.points))
    facet = np.full(int(which.max(initial=-1)) + 1, -1, dtype=np.int64)
    facet[which[: len(rows)]] = np.arange(len(rows))
    owner = facet[which[len(rows) :]]
    still[cells[owner < 0]] = True
    return mark_sets(mesh, owner[owner >= 0], numbers[owner >= 0], len(rows), 2)


def facet_keys(rows: Longs, nodes: int) -> Longs:
    """(F,) a number for each of some facets (F, 3), the same for those of the same nodes."""
    low, middle, high = np.sort(rows, axis=1).T.astype(np.int64)
    _, pair = np.unique(low * nodes + middle, return_inverse=True)
    _, which = np.unique(pair.reshape(-1) * nodes + high, return_inverse=True)
    numbers: Longs = which.reshape(-1)
    return numbers

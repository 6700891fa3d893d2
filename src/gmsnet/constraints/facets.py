"""The facets of a surface in space on which nodes slide: the boundary of tetrahedra, or a mesh of its own."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import CELLS
from gmsnet.constraints.features import dot, lengths_of
from gmsnet.constraints.outline import Flags, Longs, line_cells, mark_sets
from gmsnet.kernels.star.chords import CLOSER
from gmsnet.kernels.whole import edges as kernels
from gmsnet.mesh.mesh import Mesh
from gmsnet.topology.held import SMOOTHED
from gmsnet.topology.solids import WoundSolids, halved
from gmsnet.topology.topology import Topology
from gmsnet.topology.wound import Wound

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Facets:
    """Triangles of a surface.

    rows: (F, 3) node ids, counter-clockwise as seen from outside. label: (F,), equal for facets of the same region with
    the same marks; names: label → the names of the marks. lines: (L, 2) node ids, the ends of line cells; line_marks
    (L,). still: (N,) bool, nodes that stay whatever lies around them. closed: an edge of one facet is a mistake; else
    it is the boundary of the surface. halves: how many of the last rows are halves of quads: first those with the
    corners 0, 1 and 2 of each, then those with 0, 2 and 3.
    """

    rows: Longs
    label: Longs
    names: tuple[tuple[str, ...], ...]
    lines: Longs
    line_marks: Longs
    still: Flags
    closed: bool = True
    halves: int = 0

    def bound(self, points: Floats, share: float) -> float:
        """How far places that are looked at may go, so that all stay within a share of the diagonal of the box around
        the facets. points: (N, 3)."""
        used = np.zeros(len(points), dtype=bool)
        used[self.rows] = True
        return CLOSER * share * float(np.linalg.norm(np.ptp(points[used], axis=0))) if len(self.rows) else 0.0


def boundary_of(mesh: Mesh, wound: Wound | WoundSolids) -> Facets:
    """The boundary of the volumes of a mesh; its quadrilaterals are halved."""
    rows = wound.memory[wound.boundary].astype(np.int64)
    region = wound.region[wound.boundary_cell] if len(wound.region) else np.zeros(len(rows), dtype=np.int64)
    lines, line_marks, still = line_cells(mesh)
    halves = wound.boundary_halves if isinstance(wound, WoundSolids) else 0
    marks, names = _marks(mesh, rows, still, halves=isinstance(wound, WoundSolids))
    table, label = np.unique(np.column_stack([region, marks]), axis=0, return_inverse=True)
    of_label = tuple(names[row] for row in table[:, 1].tolist())
    return Facets(rows, label.reshape(-1), of_label, lines, line_marks, still, halves=halves)


def surface_itself(mesh: Mesh, topology: Topology) -> Facets:
    """The triangles of a mesh in no plane, wound alike, and then two of each quad."""
    rows = np.where(topology.orientation[:, None] > 0, topology.triangles, topology.triangles[:, [0, 2, 1]])
    quads = np.where(topology.quad_orientation[:, None] > 0, topology.quads, topology.quads[:, [0, 3, 2, 1]])
    halves = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    lines, line_marks, still = line_cells(mesh)
    for block in mesh.cells:
        if block.dimension in (None, 2, 3) and block.kind not in SMOOTHED:
            still[block.nodes] = True
    cells = np.concatenate([topology.cell, topology.quad_cell, topology.quad_cell])
    region = np.concatenate([np.zeros(0, dtype=np.int64), *(block.regions for block in mesh.cells)])[cells]
    numbers, label = np.unique(region, return_inverse=True)
    names = tuple((mesh.region_names.get((2, number), str(number)),) for number in numbers.tolist())
    every = np.concatenate([rows, halves]).astype(np.int64)
    return Facets(every, label.reshape(-1).astype(np.int64), names, lines, line_marks, still, False, len(halves))


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


def edge_lengths(facets: Facets, points: Floats, mesh: Mesh) -> Floats:
    """(N,) the mean length of the edges of cells at each node of the facets, those inside of volumes among them."""
    if facets.closed:
        at = np.zeros(len(points), dtype=bool)
        at[facets.rows] = True
        pairs = _edges_of_volumes(mesh, at)
    else:
        half, whole = facets.halves // 2, facets.rows[: len(facets.rows) - facets.halves]
        first, second = facets.rows[len(whole) : len(whole) + half], facets.rows[len(whole) + half :]
        sides = whole[:, [0, 1]], whole[:, [1, 2]], whole[:, [2, 0]]
        pairs = np.concatenate([*sides, first[:, :2], first[:, 1:], second[:, 1:], second[:, [2, 0]]])
    lengths: Floats = np.zeros(len(points))
    kernels.mean_edges(pairs, points, lengths)
    return lengths


def _edges_of_volumes(mesh: Mesh, at: Flags) -> Longs:
    """(E, 2) those of volume cells that have a node in ``at`` (N,); some stand there more than once."""
    pairs = [np.empty((0, 2), dtype=np.int64)]
    for block in mesh.cells:
        if block.dimension == 3 and block.kind in CELLS:
            rows = block.nodes[at[block.nodes].any(axis=1)]
            found = rows[:, [edge[:2] for edge in CELLS[block.kind].edges]].reshape(-1, 2)
            pairs.append(found[at[found].any(axis=1)].astype(np.int64))
    return np.concatenate(pairs)


def diagonals_apart(facets: Facets, points: Floats) -> Floats:
    """(N,) how far apart the two diagonals of a quadrilateral at each node pass each other, at most: 0 in a plane."""
    quads, found = facets.halves // 2, np.zeros(len(points))
    first, second = facets.rows[len(facets.rows) - 2 * quads :][:quads], facets.rows[len(facets.rows) - quads :]
    corners = np.column_stack([first, second[:, 2]])
    a, b, c, d = points[corners].transpose(1, 0, 2)
    normal = np.cross(c - a, d - b)
    length, across = lengths_of(normal), abs(dot(b - a, normal))
    np.maximum.at(found, corners, np.divide(across, length, out=np.zeros(quads), where=length > 0.0)[:, None])
    return found


def facet_keys(rows: Longs, nodes: int) -> Longs:
    """(F,) a number for each of some facets (F, 3), the same for those of the same nodes."""
    low, middle, high = np.sort(rows, axis=1).T.astype(np.int64)
    _, pair = np.unique(low * nodes + middle, return_inverse=True)
    _, which = np.unique(pair.reshape(-1) * nodes + high, return_inverse=True)
    numbers: Longs = which.reshape(-1)
    return numbers

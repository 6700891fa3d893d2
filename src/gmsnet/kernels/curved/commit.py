"""Guarded moves of single nodes in meshes of second-order cells.

A node moves together with what it drags along. The move is made if afterwards each cell around the node

- is certainly valid, or was certainly invalid before and has its smallest Bernstein coefficient certainly risen;
- has positive determinants at the corners of its straight edges, unless it certainly had not before;
- where the node is a corner and a floor is given, has the D/L of its straight edges certified above it at each corner;
- has a ``quality_of`` of ``room`` or more, unless it was not certainly valid before, or is of first order.

Else the shift is halved, or at last dropped, and all bits are as they were. With the node all cells that it or what it
drags is in are cells around the node. So nothing else changes, and nodes without a common cell can move at once.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.curved.stars import CENTRE, place, remember
from gmsnet.kernels.jit.compile import inlined, kernel, part
from gmsnet.kernels.simplex.bernstein import CORNERS, NODES
from gmsnet.kernels.simplex.jacobian import (
    CellWorkspace,
    cell_workspace,
    expand,
    gather_cell,
    quality_of,
    sign_everywhere,
    smallest,
    straight_mean,
    straight_sign,
)
from gmsnet.kernels.simplex.mean_ratio2 import Weights
from gmsnet.kernels.simplex.predicates import UNIT
from gmsnet.kernels.star.block import DROPPED, MOVED, TRUNCATED
from gmsnet.kernels.star.guard import WITH_FLOORS, margin_above
from gmsnet.kernels.star.truncation import HALVINGS

MODEL_ROWS = 20  # of a cell: its coefficients, then the determinants at its straight corners
SAMPLES = 6  # values that determine a quadratic polynomial in two variables
SQUARE_CORNER = Weights(math.sqrt(3.0), math.sqrt(3.0), 0.0, 0.5)


class CurvedWorkspace(NamedTuple):
    """The arrays for one node at a time. saved: what it and the nodes that it drags were."""

    cell: CellWorkspace
    node: NDArray[np.int64]
    saved: NDArray[np.float64]
    sign: NDArray[np.int64]
    straight: NDArray[np.int64]
    least: NDArray[np.float64]
    scale: NDArray[np.float64]
    model: NDArray[np.float64]


@part
def curved_workspace(mesh):
    """For the nodes of a mesh."""
    cells, edges = 1, 0
    for i in range(len(mesh.cell_start) - 1):
        cells = max(cells, mesh.cell_start[i + 1] - mesh.cell_start[i])
        edges = max(edges, mesh.edge_start[i + 1] - mesh.edge_start[i])
    most = 1 + edges + cells
    return CurvedWorkspace(
        cell_workspace(), np.empty(most, dtype=np.int64), np.empty((most, 2)), np.empty(cells, dtype=np.int64),
        np.empty(cells, dtype=np.int64), np.empty(cells), np.empty(cells), np.empty((cells * MODEL_ROWS, SAMPLES)),
    )  # fmt: skip


@inlined
def save(points, mesh, i, work):
    """Keeps the coordinates of a node and of what it drags along; returns how many nodes those are."""
    count = 1
    work.node[0] = i
    for k in range(mesh.edge_start[i], mesh.edge_start[i + 1]):
        if mesh.dragged[mesh.edge_of[k]]:
            work.node[count] = mesh.edges[mesh.edge_of[k], 2]
            count += 1
    for k in range(mesh.cell_start[i], mesh.cell_start[i + 1]):
        c = mesh.cell_of[k]
        if mesh.centre_dragged[c] and mesh.cells[c, CENTRE] != i:
            work.node[count] = mesh.cells[c, CENTRE]
            count += 1
    for k in range(count):
        work.saved[k, 0], work.saved[k, 1] = points[work.node[k], 0], points[work.node[k], 1]
    return count


@inlined
def restore(points, count, work):
    """Writes back what ``save`` has kept."""
    for k in range(count):
        points[work.node[k], 0], points[work.node[k], 1] = work.saved[k, 0], work.saved[k, 1]


@inlined
def above_floor(kind, delta, floor, work):
    """Is D/L certified above the floor at each corner of the straight cell that was gathered?"""
    nodes, corners, size = work.nodes, CORNERS[kind], 0.0
    for k in range(corners):
        size = max(size, max(abs(nodes[k, 0]), abs(nodes[k, 1])))
    for k in range(1 if corners == 3 else 4):
        after, last = k + 1 if k + 1 < corners else 0, k - 1 if k > 0 else corners - 1
        px, py = nodes[after, 0] - nodes[k, 0], nodes[after, 1] - nodes[k, 1]
        qx, qy = nodes[last, 0] - nodes[k, 0], nodes[last, 1] - nodes[k, 1]
        known = delta + UNIT * size  # relative to the first node
        if corners == 3:
            margin = margin_above(px, py, qx, qy, known, floor, None)
        else:
            margin = margin_above(px, py, qx, qy, known, floor, SQUARE_CORNER)
        if not margin > 0.0:
            return False
    return True


@inlined
def floor_of(guard, cell, kind):
    """The floor of a cell's D/L: of the mesh, or the largest of its corners' at the level STAR."""
    floor = guard.floor
    if len(guard) == WITH_FLOORS:
        for k in range(CORNERS[kind]):
            floor = max(floor, guard.floors[cell[k]])
    return floor


@inlined
def has_room(kind, bound, room, work):
    """Is the ``quality_of`` the expanded cell ``room`` or more? Most often its coefficients tell, uncut."""
    least, _ = smallest(kind, work.coefficients)
    return least - bound >= room * straight_mean(kind, work) or quality_of(kind, bound, work) >= room


@inlined
def judge_before(points, mesh, i, guard, work):
    """Signs and smallest coefficients (at most so large) of the cells around a node, into the workspace."""
    for k in range(mesh.cell_start[i], mesh.cell_start[i + 1]):
        c, at = mesh.cell_of[k], k - mesh.cell_start[i]
        kind = mesh.kinds[c]
        delta = guard.unit * gather_cell(points, mesh.cells[c], kind, work.cell) + guard.grain
        bound = expand(kind, delta, work.cell)
        least, _ = smallest(kind, work.cell.coefficients)
        work.least[at] = least + bound
        work.sign[at] = sign_everywhere(kind, bound, work.cell)
        work.straight[at] = straight_sign(kind, delta, work.cell)


@inlined
def allowed_now(points, mesh, i, guard, room, work):
    """Do the cells around a node fulfil the rule, compared with what ``judge_before`` has found?"""
    is_corner = mesh.corner[i]  # else straight cells stay as they are
    for k in range(mesh.cell_start[i], mesh.cell_start[i + 1]):
        c, at = mesh.cell_of[k], k - mesh.cell_start[i]
        if not cell_allowed(
            points, mesh, c, guard, room, is_corner, work.straight[at], work.sign[at], work.least[at], work.cell
        ):
            return False
    return True


@inlined
def cell_allowed(points, mesh, c, guard, room, moved, straight, sign, least_before, work):
    """Does a cell fulfil the rule? moved: has one of its corners? straight, sign, least_before: what it was."""
    kind = mesh.kinds[c]
    delta = guard.unit * gather_cell(points, mesh.cells[c], kind, work) + guard.grain
    if straight != -1 and straight_sign(kind, delta, work) != 1:
        return False
    floor = floor_of(guard, mesh.cells[c], kind)
    if moved and floor > -np.inf and not above_floor(kind, delta, floor, work):
        return False
    bound = expand(kind, delta, work)
    least, _ = smallest(kind, work.coefficients)
    if sign == -1 and least - bound > least_before:
        return True
    if sign_everywhere(kind, bound, work) != 1:
        return False
    curved = NODES[kind] > CORNERS[kind]
    return not (curved and room > -np.inf and sign == 1 and not has_room(kind, bound, room, work))


@part
def commit_curved(points, mesh, i, x, y, guard, room, work, tally):
    """Moves a node towards (x, y) with what it drags along, as far as the rule allows.

    The node may be a corner, a middle or a centre; the offset of a middle or a centre is stored anew. The caller sees
    to it that the node is free. guard: a MeshGuard or StarGuard, floors by node. room: see above, −∞ for none. tally:
    see kernels.star.block. Returns how many nodes have moved: 0, or it and those that it drags, whose old places stand
    in the workspace (see ``restore``).
    """
    dx, dy = x - points[i, 0], y - points[i, 1]
    if not (np.isfinite(dx) and np.isfinite(dy)):
        tally[DROPPED] += 1
        return 0
    count = save(points, mesh, i, work)
    judge_before(points, mesh, i, guard, work)
    for halving in range(HALVINGS):
        place(points, mesh, i, work.saved[0, 0] + dx, work.saved[0, 1] + dy, guard.single)
        if points[i, 0] == work.saved[0, 0] and points[i, 1] == work.saved[0, 1]:
            break
        if allowed_now(points, mesh, i, guard, room, work):
            remember(points, mesh, i)
            tally[MOVED] += 1
            tally[TRUNCATED] += halving > 0
            return count
        dx *= 0.5
        dy *= 0.5
    restore(points, count, work)
    tally[DROPPED] += 1
    return 0


@kernel
def follow(points, mesh, nodes, places, guard, room, tally):
    """``commit_curved`` for those of the nodes (K,) that are not yet where ``places`` (N, 2) says, in their order.

    Returns how many are still not there.
    """
    work, left = curved_workspace(mesh), 0
    for k in range(len(nodes)):
        i = nodes[k]
        if points[i, 0] != places[i, 0] or points[i, 1] != places[i, 1]:
            commit_curved(points, mesh, i, places[i, 0], places[i, 1], guard, room, work, tally)
            left += points[i, 0] != places[i, 0] or points[i, 1] != places[i, 1]
    return left


@kernel
def all_valid(points, mesh, cells, guard):
    """Are all of these cells (K,) certainly valid, and their straight ones?"""
    work = cell_workspace()
    for c in cells:
        kind = mesh.kinds[c]
        delta = guard.unit * gather_cell(points, mesh.cells[c], kind, work) + guard.grain
        if straight_sign(kind, delta, work) != 1 or sign_everywhere(kind, expand(kind, delta, work), work) != 1:
            return False
    return True


@kernel
def all_allowed(points, mesh, cells, guard, room):
    """Do all of these cells (K,), certainly valid before, fulfil the rule where corners of theirs have moved?"""
    work, count = cell_workspace(), 0
    while count < len(cells) and cell_allowed(points, mesh, cells[count], guard, room, True, 1, 1, 0.0, work):
        count += 1
    return count == len(cells)

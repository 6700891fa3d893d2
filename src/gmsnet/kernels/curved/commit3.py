"""The rule of kernels.curved.commit for volumes: guarded moves of single nodes, and of all corners at once.

A node moves with its followers. The move is made if afterwards each cell around it

- is certified valid everywhere, or was certainly invalid before and has its smallest coefficient certainly risen;
- has positive corner simplices of straight edges, unless it certainly had not before;
- where the node is a corner and a floor is given, has each of these certified above it (kernels.star.guard3).

Else the shift is halved, or at last dropped, and all bits are as they were.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.curved.stars3 import NO_FOLLOWER, place3, remember3
from gmsnet.kernels.jit.compile import inlined, kernel, part
from gmsnet.kernels.simplex.jacobian3 import COEFFICIENTS, DEPTH, expand_solid, gather_solid, solid_workspace
from gmsnet.kernels.simplex.mean_ratio3 import determinant, weights_at
from gmsnet.kernels.simplex.orientation3 import determinant_and_bound
from gmsnet.kernels.simplex.validity3 import INVALID, VALID, minimum_of_solid, sign_of_solid, smallest_solid
from gmsnet.kernels.star.block import DROPPED, MOVED, TRUNCATED
from gmsnet.kernels.star.guard import WITH_FLOORS
from gmsnet.kernels.star.guard3 import certified
from gmsnet.kernels.star.truncation import HALVINGS

STRAIGHT = 8  # corner simplices of a cell at most


class Around(NamedTuple):
    """The arrays for one node at a time. saved: what it and its followers were; the rest of the cells around it."""

    solid: NDArray[np.float64]
    node: NDArray[np.int64]
    saved: NDArray[np.float64]
    sign: NDArray[np.int64]
    straight: NDArray[np.int64]
    least: NDArray[np.float64]
    scale: NDArray[np.float64]
    model: NDArray[np.float64]


@part
def around_workspace(mesh, rows, samples):
    """For the nodes of a mesh. rows: of a model, a cell; samples: of each."""
    cells, followers = 1, 0
    for i in range(len(mesh.cell_start) - 1):
        cells = max(cells, mesh.cell_start[i + 1] - mesh.cell_start[i])
        followers = max(followers, mesh.start[i + 1] - mesh.start[i])
    most = 1 + followers
    return Around(
        solid_workspace(), np.empty(most, dtype=np.int64), np.empty((most, 3)), np.empty(cells, dtype=np.int64),
        np.empty(cells, dtype=np.int64), np.empty(cells), np.empty(cells), np.empty((cells * rows, samples)),
    )  # fmt: skip


@part
def expanded(points, mesh, c, unit, grain, work):
    """The coefficients of a cell into the workspace; returns their error bound."""
    form = mesh.forms[mesh.kinds[c]]
    delta = unit * gather_solid(points, mesh.cells[c], form, -1, 0.0, 0.0, 0.0, work) + grain
    return expand_solid(form, 1.0, delta, work)


@inlined
def spokes3(points, mesh, c, s):
    """The spokes of a corner simplex of a cell, and the largest coordinate of its nodes."""
    cell, simplex = mesh.cells[c], mesh.simplices[mesh.kinds[c], s]
    v, a, b, d = cell[simplex[0]], cell[simplex[1]], cell[simplex[2]], cell[simplex[3]]
    x, y, z = points[v, 0], points[v, 1], points[v, 2]
    reach = max(max(abs(x), abs(y)), abs(z))
    for k in (a, b, d):
        reach = max(reach, max(max(abs(points[k, 0]), abs(points[k, 1])), abs(points[k, 2])))
    return (
        points[a, 0] - x, points[a, 1] - y, points[a, 2] - z, points[b, 0] - x, points[b, 1] - y, points[b, 2] - z,
        points[d, 0] - x, points[d, 1] - y, points[d, 2] - z, reach,
    )  # fmt: skip


@part
def least_straight3(points, mesh, c):
    """The least determinant at the corners of the straight cell."""
    least = np.inf
    for s in range(STRAIGHT):
        if mesh.simplices[mesh.kinds[c], s, 0] < 0:
            break
        ax, ay, az, bx, by, bz, cx, cy, cz, _ = spokes3(points, mesh, c, s)
        least = min(least, determinant(ax, ay, az, bx, by, bz, cx, cy, cz))
    return least


@part
def quality_over3(least, form, bound, enough, work):
    """The lower bound of det J over that least determinant, sharp where it is less than ``enough``; else −∞."""
    if not least > 0.0:
        return -np.inf
    uncut = (smallest_solid(form, COEFFICIENTS, work) - bound) / least
    return uncut if uncut >= enough else minimum_of_solid(form, bound, work) / least


@part
def quality3(points, mesh, c, enough, unit, grain, work):
    """The lower bound of det J over the least determinant at a corner of the straight cell: about 1 if straight.

    −∞ where that is not positive. Sharp where it is less than ``enough``.
    """
    bound = expanded(points, mesh, c, unit, grain, work)
    return quality_over3(least_straight3(points, mesh, c), mesh.forms[mesh.kinds[c]], bound, enough, work)


@part
def straight_sign3(points, mesh, c, floor, unit, grain):
    """1 where all corner simplices of a cell are certified above a floor, −1 where one is certainly not positive."""
    kind, found = mesh.kinds[c], 1
    weights = weights_at(mesh.shapes, kind)
    for s in range(STRAIGHT):
        if mesh.simplices[kind, s, 0] < 0:
            break
        ax, ay, az, bx, by, bz, cx, cy, cz, reach = spokes3(points, mesh, c, s)
        delta = unit * reach + grain
        if certified(ax, ay, az, bx, by, bz, cx, cy, cz, delta, floor, weights):
            continue
        value, bound = determinant_and_bound(ax, ay, az, bx, by, bz, cx, cy, cz, delta)
        if value < -bound:
            return -1
        found = 0
    return found


@inlined
def floor_of3(guard, mesh, c):
    """The floor of a cell: of the mesh, or the largest of its corners' at the level STAR."""
    floor = max(guard.floor, 0.0)
    if len(guard) == WITH_FLOORS:
        for k in range(mesh.corners[mesh.kinds[c]]):
            floor = max(floor, guard.floors[mesh.cells[c, k]])
    return floor


@part
def save3(points, mesh, i, work):
    """Keeps the coordinates of a node and its followers; returns how many nodes those are."""
    count = 1
    work.node[0] = i
    for k in range(mesh.start[i], mesh.start[i + 1]):
        if mesh.dragged[mesh.follower_of[k]]:
            work.node[count] = mesh.follower[mesh.follower_of[k]]
            count += 1
    for k in range(count):
        for axis in range(3):
            work.saved[k, axis] = points[work.node[k], axis]
    return count


@part
def restore3(points, count, work):
    """Writes back what ``save3`` has kept."""
    for k in range(count):
        for axis in range(3):
            points[work.node[k], axis] = work.saved[k, axis]


@inlined
def is_corner(mesh, i):
    """Do nodes follow this one? Then straight cells change with it."""
    return mesh.number[i] == NO_FOLLOWER


@part
def allowed3(points, mesh, i, guard, work):
    """Do the cells around a node fulfil the rule, compared with what they were?"""
    for k in range(mesh.cell_start[i], mesh.cell_start[i + 1]):
        c, at = mesh.cell_of[k], k - mesh.cell_start[i]
        if is_corner(mesh, i):
            straight = straight_sign3(points, mesh, c, floor_of3(guard, mesh, c), guard.unit, guard.grain)
            if straight != 1 and work.straight[at] != -1:
                return False
        bound = expanded(points, mesh, c, guard.unit, guard.grain, work.solid)
        form = mesh.forms[mesh.kinds[c]]
        if work.sign[at] == INVALID and smallest_solid(form, COEFFICIENTS, work.solid) - bound > work.least[at]:
            continue
        if sign_of_solid(form, bound, DEPTH, work.solid) != VALID:
            return False
    return True


@part
def commit3(points, mesh, i, x, y, z, guard, work, tally):
    """Moves a node towards (x, y, z) with its followers, as far as the rule allows; keeps a follower's new offset.

    Returns how many nodes have moved, whose old places stand in the workspace (see ``restore3``).
    """
    dx, dy, dz = x - points[i, 0], y - points[i, 1], z - points[i, 2]
    if not (np.isfinite(dx) and np.isfinite(dy) and np.isfinite(dz)):
        tally[DROPPED] += 1
        return 0
    count = save3(points, mesh, i, work)
    for k in range(mesh.cell_start[i], mesh.cell_start[i + 1]):
        c, at = mesh.cell_of[k], k - mesh.cell_start[i]
        bound = expanded(points, mesh, c, guard.unit, guard.grain, work.solid)
        form = mesh.forms[mesh.kinds[c]]
        work.least[at] = smallest_solid(form, COEFFICIENTS, work.solid) + bound
        work.sign[at] = sign_of_solid(form, bound, DEPTH, work.solid)
        work.straight[at] = straight_sign3(points, mesh, c, 0.0, guard.unit, guard.grain)
    for halving in range(HALVINGS):
        sx, sy, sz = work.saved[0]
        place3(points, mesh, i, sx + dx, sy + dy, sz + dz, guard.single)
        if points[i, 0] == sx and points[i, 1] == sy and points[i, 2] == sz:
            break
        if allowed3(points, mesh, i, guard, work):
            if mesh.number[i] != NO_FOLLOWER:
                remember3(points, mesh, mesh.number[i])
            tally[MOVED] += 1
            tally[TRUNCATED] += halving > 0
            return count
        dx, dy, dz = 0.5 * dx, 0.5 * dy, 0.5 * dz
    restore3(points, count, work)
    tally[DROPPED] += 1
    return 0


@kernel
def judge_curved_solids(points, mesh, cells, unit, grain, enough, sign, quality):
    """The sign and the ``quality3`` of some cells (K,), into sign (K,) int8 and quality (K,)."""
    work = solid_workspace()
    for k in range(len(cells)):
        c = cells[k]
        form = mesh.forms[mesh.kinds[c]]
        bound = expanded(points, mesh, c, unit, grain, work)
        sign[k] = sign_of_solid(form, bound, DEPTH, work)
        quality[k] = quality_over3(least_straight3(points, mesh, c), form, bound, enough, work)


@kernel
def straight_signs3(points, mesh, cells, unit, grain, sign):
    """``straight_sign3`` of some cells (K,) above zero, into sign (K,) int8."""
    for k in range(len(cells)):
        sign[k] = straight_sign3(points, mesh, cells[k], 0.0, unit, grain)


@kernel
def refused(points, mesh, cells, guard, room, found):
    """Which of some cells (K,) break the rule for valid ones, or have a ``quality3`` of less than room (C,)."""
    work = solid_workspace()
    for k in range(len(cells)):
        c = cells[k]
        found[k] = straight_sign3(points, mesh, c, floor_of3(guard, mesh, c), guard.unit, guard.grain) != 1
        if found[k]:
            continue
        form = mesh.forms[mesh.kinds[c]]
        bound = expanded(points, mesh, c, guard.unit, guard.grain, work)
        found[k] = sign_of_solid(form, bound, DEPTH, work) != VALID
        if not found[k] and room > -np.inf:
            found[k] = not quality_over3(least_straight3(points, mesh, c), form, bound, room, work) >= room

"""What every smoother in space shares: gather a block of stars, judge its steps, commit those that break nothing."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import inlined, part
from gmsnet.kernels.simplex.orientation3 import largest_component
from gmsnet.kernels.star.block import DROPPED, MOVED, TRUNCATED
from gmsnet.kernels.star.fold import refuse_spoiling, spoils
from gmsnet.kernels.star.guard import WITH_FLOORS
from gmsnet.kernels.star.guard3 import MIXED_BOUND, WIDER, certified, floor_at, sound
from gmsnet.kernels.star.slide3 import land3, note_places, on_surface, take_place
from gmsnet.kernels.star.space import KEPT, SUMS, derive, judge, relate
from gmsnet.kernels.star.space_blocks import LANES3, is_present, rows_in, weights_in_row
from gmsnet.kernels.star.verdict3 import certify, settle

LINE = 64  # bytes
HALVINGS = 12  # of a step that is not allowed


class Workspace3(NamedTuple):
    """The arrays that a sweep works in. star: the centres. reach: their largest component. size: of each star, inverse:
    1/size in float32. width: the largest component of each star, over its size. allowed: which lanes may be moved as
    they are. row: of the nodes that slide, else below 0; target, place: where these go (slide3).
    """

    star: NDArray[np.float64]
    reach: NDArray[np.float64]
    size: NDArray[np.float64]
    inverse: NDArray[np.float32]
    local: NDArray[np.float32]
    kept: NDArray[np.float32]
    sums: NDArray[np.float32]
    step: NDArray[np.float32]
    wide: NDArray[np.float32]
    width: NDArray[np.float32]
    allowed: NDArray[np.bool_]
    row: NDArray[np.int32]
    target: NDArray[np.float64]
    place: NDArray[np.int64]


@inlined
def aligned(count, kind):
    """An array that begins with a line of the cache: a vector that lies in two of them takes twice as long."""
    whole = np.empty(count + LINE, dtype=kind)
    first = (-whole.ctypes.data % LINE) // whole.itemsize
    return whole[first : first + count]


@inlined
def aligned_of_star(count, kind):
    """The same of as many numbers as a star has nodes, or simplices, times some."""
    return aligned(count, kind)


@part
def workspace3_for(most, most_simplices):
    """For stars of up to so many nodes around and simplices."""
    return Workspace3(
        aligned(4 * LANES3, np.float64), aligned(LANES3, np.float64), aligned(LANES3, np.float64),
        aligned(LANES3, np.float32), aligned_of_star(4 * most * LANES3, np.float32),
        aligned_of_star(KEPT * most_simplices * LANES3, np.float32), aligned(SUMS * LANES3, np.float32),
        aligned(3 * LANES3, np.float32), aligned(4 * LANES3, np.float32), aligned(LANES3, np.float32),
        aligned(LANES3, np.bool_), aligned(LANES3, np.int32), aligned(4 * LANES3, np.float64),
        aligned(LANES3, np.int64),
    )  # fmt: skip


@part
def fetch3(points, blocks, block, workspace):
    """Gathers a block, over the size of each star: the first of its ring is at a distance of 1 in the sum of axes."""
    star, wide = workspace.star, workspace.wide
    n, offset = np.int64(blocks.degree[block]), blocks.offset[block]
    for lane in range(LANES3):
        i, j = np.uint32(blocks.centre[block * LANES3 + lane]), np.uint32(blocks.ring[offset + lane])
        for k in range(4):
            star[4 * lane + k] = points[i, k]
        size = abs(points[j, 0] - points[i, 0]) + abs(points[j, 1] - points[i, 1]) + abs(points[j, 2] - points[i, 2])
        size = size if size > 0.0 else 1.0
        workspace.reach[lane] = max(abs(star[4 * lane]), max(abs(star[4 * lane + 1]), abs(star[4 * lane + 2])))
        workspace.size[lane] = size
        workspace.inverse[lane] = np.float32(1.0 / size)
    relate(points, blocks.ring, offset, n, star, workspace.inverse, workspace.local)
    for k in range(4 * LANES3):
        wide[k] = 0.0
    for j in range(n):
        row = workspace.local[4 * j * LANES3 : 4 * (j + 1) * LANES3]
        for k in range(4 * LANES3):
            wide[k] = max(wide[k], abs(row[k]))
    for lane in range(LANES3):
        workspace.width[lane] = max(wide[4 * lane], max(wide[4 * lane + 1], wide[4 * lane + 2]))


@part
def derive3(blocks, block, power, soft, workspace):
    """The sums of a block that has been fetched. power: a Power3; soft: see ``derive``."""
    _derive(blocks.mixture, blocks, block, power, soft, workspace)


@inlined
def _derive(mixture, blocks, block, power, soft, workspace):
    rows = np.int64(blocks.simplices[block])
    if mixture is None:
        derive(
            workspace.local, blocks.spoke, blocks.at[block], rows, blocks.cells, block, power.number, power.constants,
            soft, power.wall, power.squarings, workspace.kept, workspace.sums, None, None, None,
        )  # fmt: skip
    else:
        derive(
            workspace.local, blocks.spoke, blocks.at[block], rows, blocks.cells, block, power.number, power.constants,
            soft, power.wall, power.squarings, workspace.kept, workspace.sums, mixture.role, mixture.present,
            mixture.weights,
        )  # fmt: skip


@part
def judge3(blocks, block, power, soft, floor, workspace, surface=None, trial=0):
    """What follows of them after the step. floor: c, of D/S^(3/2). surface: what nodes slide on; trial: see land3."""
    land3(surface, blocks, block, trial, workspace)
    _judge(blocks.mixture, blocks, block, power, soft, floor, workspace)


@inlined
def _judge(mixture, blocks, block, power, soft, floor, workspace):
    rows, at = np.int64(blocks.simplices[block]), blocks.at[block]
    if mixture is None:
        judge(
            workspace.kept, rows, blocks.cells, block, power.number, power.constants, soft, workspace.step, floor,
            workspace.sums, at, power.wall, power.squarings, None, None, None,
        )  # fmt: skip
    else:
        judge(
            workspace.kept, rows, blocks.cells, block, power.number, power.constants, soft, workspace.step, floor,
            workspace.sums, at, power.wall, power.squarings, mixture.role, mixture.present, mixture.weights,
        )  # fmt: skip


@inlined
def certify3(workspace, unit, grain, mixture):
    """``allowed``: which lanes are certified above the floor that their row MARGIN was made with, after their step."""
    certify(
        workspace.sums, workspace.step, workspace.width, workspace.reach, workspace.size, unit, grain,
        doubt_of(mixture), workspace.allowed,
    )  # fmt: skip


@inlined
def settle3(workspace, unit, grain, last, mixture=None):
    """Which lanes may go as they are: certified, and F falls. Where F does not fall the step is halved; counts them.

    mixture: of the blocks. last: there is no further trial, and such steps become zero. What falls and is not certified
    may be so in float64: halved, a sliver's step would be no more certain, and lead nowhere.
    """
    return settle(
        workspace.sums, workspace.step, workspace.width, workspace.reach, workspace.size, unit, grain,
        doubt_of(mixture), workspace.allowed, last,
    )  # fmt: skip


@inlined
def doubt_of(mixture):
    """By how much the bound of tetrahedra is multiplied."""
    if mixture is None:
        return WIDER
    return WIDER * MIXED_BOUND


@inlined
def place_after(workspace, guard, lane):
    """Where the free node of a lane that is allowed will be, as it is written."""
    star, step = workspace.star, workspace.step
    # 1/size in float32 is not quite 1/size: the step is of what was gathered
    size = 1.0 / np.float64(workspace.inverse[lane])
    dx, dy, dz = size * step[lane], size * step[LANES3 + lane], size * step[2 * LANES3 + lane]
    x, y, z = star[4 * lane] + dx, star[4 * lane + 1] + dy, star[4 * lane + 2] + dz
    if guard.constraint is not None and workspace.row[lane] >= 0:
        x, y, z = workspace.target[4 * lane], workspace.target[4 * lane + 1], workspace.target[4 * lane + 2]
    if guard.single:
        x, y, z = np.float64(np.float32(x)), np.float64(np.float32(y)), np.float64(np.float32(z))
    return x, y, z


@inlined
def look_inside(mixture, points, blocks, block, workspace, guard):
    """Lanes a cell of which is not certified to be valid between its corners are no longer allowed."""
    if mixture is not None:
        for lane in range(blocks.filled[block]):
            if workspace.allowed[lane]:
                i = np.int64(blocks.centre[block * LANES3 + lane])
                x, y, z = place_after(workspace, guard, lane)
                workspace.allowed[lane] = sound(mixture, points, i, x, y, z, guard.unit, guard.grain)


@inlined
def store3(points, blocks, block, workspace, guard, tally):
    """Moves the free nodes of the lanes that are allowed; returns whether others have steps, to be tried alone.

    Those are rare, and what tries them counts references to each array that it hands on: it is called outside the loop
    over blocks.
    """
    if len(guard) != WITH_FLOORS:
        refuse_spoiling(points, blocks, block, guard.constraint, workspace)
        look_inside(blocks.mixture, points, blocks, block, workspace, guard)
        note_places(guard.constraint, workspace)
    return commit3(points, blocks.centre, block, blocks.filled[block], workspace, guard, tally)


@part
def commit3(points, centre, block, count, workspace, guard, tally):
    """Moves the free nodes of the lanes that are allowed; returns whether others have steps."""
    step, rest, moved = workspace.step, False, 0
    for lane in range(count):
        if len(guard) != WITH_FLOORS and workspace.allowed[lane]:
            i = np.uint32(centre[block * LANES3 + lane])
            x, y, z = place_after(workspace, guard, lane)
            moved += (x != points[i, 0]) | (y != points[i, 1]) | (z != points[i, 2])
            points[i, 0], points[i, 1], points[i, 2] = x, y, z
        else:
            rest |= step[lane] != 0.0 or step[LANES3 + lane] != 0.0 or step[2 * LANES3 + lane] != 0.0
    tally[MOVED] += moved
    return rest


@part
def try_alone(points, blocks, block, workspace, guard, tally):
    """The lanes that are not allowed, one by one."""
    step = workspace.step
    for lane in range(blocks.filled[block]):
        size = 1.0 / np.float64(workspace.inverse[lane])
        dx, dy, dz = size * step[lane], size * step[LANES3 + lane], size * step[2 * LANES3 + lane]
        if len(guard) != WITH_FLOORS and workspace.allowed[lane]:
            continue
        if dx != 0.0 or dy != 0.0 or dz != 0.0:
            truncate3(points, blocks, block, lane, dx, dy, dz, guard, tally)


@part
def truncate3(points, blocks, block, lane, dx, dy, dz, guard, tally):
    """Halves the step of one lane until it is allowed, or drops it."""
    i = np.uint32(blocks.centre[block * LANES3 + lane])
    x, y, z = points[i, 0], points[i, 1], points[i, 2]
    if not (np.isfinite(dx) and np.isfinite(dy) and np.isfinite(dz)):
        tally[DROPPED] += 1
        return
    for halving in range(HALVINGS):
        tx, ty, tz = x + dx, y + dy, z + dz
        tx, ty, tz, place = on_surface(guard.constraint, i, tx, ty, tz)
        if guard.single:
            tx, ty, tz = np.float64(np.float32(tx)), np.float64(np.float32(ty)), np.float64(np.float32(tz))
        if tx == x and ty == y and tz == z:
            break
        if allowed3(points, blocks, block, lane, tx, ty, tz, guard) and not spoils(
            guard.constraint, i, points, place, tx, ty, tz
        ):
            points[i, 0], points[i, 1], points[i, 2] = tx, ty, tz
            take_place(guard.constraint, i, place)
            tally[MOVED] += 1
            tally[TRUNCATED] += halving > 0
            return
        dx, dy, dz = 0.5 * dx, 0.5 * dy, 0.5 * dz
    tally[DROPPED] += 1


@part
def allowed3(points, blocks, block, lane, x, y, z, guard):
    """May the free node of one lane go to (x, y, z)? Are all its simplices certified above their floors there?"""
    at, offset, mixture = blocks.at[block], blocks.offset[block], blocks.mixture
    centre = blocks.centre[block * LANES3 + lane]
    reach = max(abs(x), max(abs(y), abs(z)))
    for k in range(rows_in(mixture, blocks, block, lane)):
        if not is_present(mixture, at, k, lane):
            continue
        row = at + 3 * k * LANES3 + lane
        a = np.uint32(blocks.ring[offset + blocks.spoke[row] * LANES3 + lane])
        b = np.uint32(blocks.ring[offset + blocks.spoke[row + LANES3] * LANES3 + lane])
        c = np.uint32(blocks.ring[offset + blocks.spoke[row + 2 * LANES3] * LANES3 + lane])
        floor = max(guard.floor, 0.0)
        if len(guard) == WITH_FLOORS:
            floor = max(floor, floor_at(mixture, guard.floors, centre, a, b, c, at, k, lane))
        ax, ay, az = points[a, 0] - x, points[a, 1] - y, points[a, 2] - z
        bx, by, bz = points[b, 0] - x, points[b, 1] - y, points[b, 2] - z
        cx, cy, cz = points[c, 0] - x, points[c, 1] - y, points[c, 2] - z
        m = largest_component(ax, ay, az, bx, by, bz, cx, cy, cz)
        delta = guard.unit * (reach + m) + guard.grain
        if not certified(ax, ay, az, bx, by, bz, cx, cy, cz, delta, floor, weights_in_row(mixture, at, k)):
            return False
    return sound(mixture, points, np.int64(centre), x, y, z, guard.unit, guard.grain)

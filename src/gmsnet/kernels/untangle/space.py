"""Untangling in space: sweeps of Newton's method on Σq^(3/2) with softened determinants (kernels.star.space.derive)."""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import kernel, part
from gmsnet.kernels.methods.barrier3 import propose3
from gmsnet.kernels.simplex.jacobian3 import solid_workspace
from gmsnet.kernels.simplex.mean_ratio3 import measured_as, same_cell3, weights_at
from gmsnet.kernels.simplex.orientation3 import determinant_and_bound, largest_component, spokes_of
from gmsnet.kernels.simplex.solid_measures import certainly_valid
from gmsnet.kernels.star.space import AFTER, VALUE
from gmsnet.kernels.star.space_blocks import LANES3
from gmsnet.kernels.star.stars3 import derive3, fetch3, judge3, workspace3_for

TRIALS = 4


@part
def fallen(workspace, last):
    """How many lanes have not: their steps are halved, or dropped where there is no further trial."""
    sums, step, refused = workspace.sums, workspace.step, 0
    for lane in range(LANES3):
        falls = sums[AFTER * LANES3 + lane] < sums[VALUE * LANES3 + lane]
        still = step[lane] == 0.0 and step[LANES3 + lane] == 0.0 and step[2 * LANES3 + lane] == 0.0
        refused += not (falls or still)
        factor = np.float32(1.0 if falls else (0.0 if last else 0.5))
        for k in range(3):
            step[k * LANES3 + lane] *= factor
    return refused


@kernel
def soften(points, blocks, first, last, softness, single, power):
    """Visits the blocks first…last (of one colour) once. softness: ε, in the units of six times a volume.

    No cell is guarded: what is positive may be inverted on the way. single: round every coordinate to float32.
    """
    workspace, soft = workspace3_for(blocks.most, blocks.most_simplices), np.empty(LANES3, dtype=np.float32)
    for block in range(first, last):
        fetch3(points, blocks, block, workspace)
        for lane in range(LANES3):
            inverse = np.float64(workspace.inverse[lane])
            soft[lane] = np.float32(max(softness * inverse * inverse * inverse, 1e-12))
        derive3(blocks, block, power, soft, workspace)
        propose3(workspace.sums, power, 1.0, workspace.step)
        for trial in range(TRIALS):
            judge3(blocks, block, power, soft, 0.0, workspace)
            if fallen(workspace, trial == TRIALS - 1) == 0:
                break
        for lane in range(blocks.filled[block]):
            i, size = np.uint32(blocks.centre[block * LANES3 + lane]), 1.0 / np.float64(workspace.inverse[lane])
            for axis in range(3):
                value = points[i, axis] + size * workspace.step[axis * LANES3 + lane]
                if np.isfinite(value):
                    points[i, axis] = np.float64(np.float32(value)) if single else value


@kernel
def find_bad_inside(points, simplices, unit, grain, bad, inverted):
    """Marks, after ``find_bad``, all simplices of the cells that are not certified to be valid between their corners.

    Returns how many simplices are bad now.
    """
    count, t, work = 0, 0, solid_workspace()
    while t < len(simplices.rows):
        end, wrong = t + 1, bad[t]
        while same_cell3(simplices.cells, t, end):
            wrong |= bad[end]
            end += 1
        if not wrong:
            cell = simplices.cells[t]
            if not certainly_valid(points, simplices.solids, cell, unit, grain, -1, 0.0, 0.0, 0.0, work):
                for k in range(t, end):
                    bad[k] = inverted[k] = True
        for k in range(t, end):
            count += bad[k]
        t = end
    return count


@kernel
def find_bad(points, rows, orientation, unit, grain, bad, inverted, ratio, shapes=None):
    """Writes of each cell (T,) whether it is not certified positive as it will be written, whether it is certainly
    inverted, and D/S^(3/2).

    Returns how many are bad.
    """
    count = 0
    for t in range(len(rows)):
        ax, ay, az, bx, by, bz, cx, cy, cz = spokes_of(points, rows, t)
        d = rows[t, 0]
        reach = max(max(abs(points[d, 0]), abs(points[d, 1])), abs(points[d, 2]))
        far = largest_component(ax, ay, az, bx, by, bz, cx, cy, cz)
        value, bound = determinant_and_bound(ax, ay, az, bx, by, bz, cx, cy, cz, unit * (reach + far) + grain)
        value *= orientation[t]
        bad[t], inverted[t] = not value > bound, value < -bound
        count += bad[t]
        weights = weights_at(shapes, t)
        _, lengths, _, _, _, _, _, _ = measured_as(ax, ay, az, bx, by, bz, cx, cy, cz, weights)
        ratio[t] = value / max(lengths * np.sqrt(max(lengths, 0.0)), 1e-300)
    return count

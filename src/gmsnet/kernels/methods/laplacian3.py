"""Laplacian smoothing in space: to the mean of the neighbours, whatever comes of it, or where the star gains by it."""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import kernel, part
from gmsnet.kernels.methods.barrier3 import TRIALS, settle3
from gmsnet.kernels.star.space import LANES3
from gmsnet.kernels.star.stars3 import certify3, derive3, fetch3, judge3, store3, workspace3_for


@part
def to_mean(blocks, block, workspace):
    """The step to the mean of the ring; a closed ball of F cells has F/2 + 2 nodes around it."""
    step, count = workspace.step, blocks.cells
    for k in range(3 * LANES3):
        step[k] = 0.0
    for j in range(np.int64(blocks.degree[block])):
        for lane in range(LANES3):
            around = count[block * LANES3 + lane] // 2 + 2
            inside = np.float32(1.0 if j < around else 0.0)
            for axis in range(3):
                step[axis * LANES3 + lane] += inside * workspace.local[4 * (j * LANES3 + lane) + axis]
    for lane in range(LANES3):
        share = np.float32(1.0) / np.float32(count[block * LANES3 + lane] // 2 + 2)
        for axis in range(3):
            step[axis * LANES3 + lane] *= share


@kernel
def sweep3(points, blocks, first, last, guard, power, smart, tally):
    """Visits the blocks first…last (of one colour) once. smart: only as far as the sum of q^(3/2) of the star falls."""
    workspace = workspace3_for(blocks.most, blocks.most_simplices)
    floor = max(guard.floor, 0.0)
    for block in range(first, last):
        fetch3(points, blocks, block, workspace)
        derive3(blocks, block, power, None, workspace)
        to_mean(blocks, block, workspace)
        for trial in range(TRIALS):
            judge3(blocks, block, power, None, floor, workspace, guard.constraint)
            if not smart:
                certify3(workspace, guard.unit, guard.grain)
                break
            if settle3(workspace, guard.unit, guard.grain, trial == TRIALS - 1) == 0:
                break
        store3(points, blocks, block, workspace, guard, tally)

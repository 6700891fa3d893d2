"""Laplacian smoothing in space: to the mean of the neighbours, whatever comes of it, or where the star gains by it."""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import inlined, kernel, part
from gmsnet.kernels.methods.barrier3 import TRIALS
from gmsnet.kernels.star.guard import unit_of_steps
from gmsnet.kernels.star.space_blocks import LANES3
from gmsnet.kernels.star.stars3 import certify3, derive3, fetch3, judge3, settle3, store3, try_alone, workspace3_for


@inlined
def is_beyond(mixture, ring, offset, block, j, lane):
    """Is row j of the ring none of an edge of the lane's star?"""
    if mixture is None:
        return j > 0 and ring[offset + j * LANES3 + lane] == ring[offset + lane]
    return j >= mixture.edges[block * LANES3 + lane]


@part
def to_mean(blocks, block, workspace):
    """The step to the mean of the nodes that an edge joins; what repeats the first one is no more of the ring."""
    step, ring, offset = workspace.step, blocks.ring, blocks.offset[block]
    for lane in range(LANES3):
        x, y, z, around = np.float32(0.0), np.float32(0.0), np.float32(0.0), 0
        for j in range(np.int64(blocks.degree[block])):
            if is_beyond(blocks.mixture, ring, offset, block, j, lane):
                break
            place = 4 * (j * LANES3 + lane)
            x, y, z = x + workspace.local[place], y + workspace.local[place + 1], z + workspace.local[place + 2]
            around += 1
        share = np.float32(1.0) / np.float32(around)
        step[lane], step[LANES3 + lane], step[2 * LANES3 + lane] = share * x, share * y, share * z


@part
def smooth_some(points, blocks, first, last, guard, power, smart, workspace, tally):
    """Visits the blocks first…last until lanes of one are to be tried alone. Returns which one, or the last."""
    floor = max(guard.floor, 0.0)
    for block in range(first, last):
        fetch3(points, blocks, block, workspace)
        derive3(blocks, block, power, None, workspace)
        to_mean(blocks, block, workspace)
        for trial in range(TRIALS):
            judge3(blocks, block, power, None, floor, workspace, guard.constraint, trial)
            if not smart:
                certify3(workspace, unit_of_steps(guard), guard.grain, blocks.mixture)
                break
            if settle3(workspace, unit_of_steps(guard), guard.grain, trial == TRIALS - 1, blocks.mixture) == 0:
                break
        if store3(points, blocks, block, workspace, guard, tally):
            return block
    return last


@kernel
def sweep3(points, blocks, first, last, guard, power, smart, tally):
    """Visits the blocks first…last (of one colour) once. smart: only as far as the sum of q^(3/2) of the star falls."""
    workspace, block = workspace3_for(blocks.most, blocks.most_simplices), first
    while block < last:
        block = smooth_some(points, blocks, block, last, guard, power, smart, workspace, tally)
        if block < last:
            try_alone(points, blocks, block, workspace, guard, tally)
            block += 1

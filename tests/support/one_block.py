"""Stars of one degree as the blocks that kernels work on."""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import LANES
from gmsnet.kernels.star.block import Blocks
from gmsnet.kernels.star.guard import plain_guard


def block_of(stars):
    """(points, blocks) of up to 64 stars (centre, ring) of one degree, nodes 0, 1, … being the centres."""
    count, degree = len(stars), len(stars[0][1])
    points = np.vstack([[centre for centre, _ in stars], *[ring for _, ring in stars]]).astype(float)
    lanes = np.minimum(np.arange(LANES), count - 1)
    rings = np.concatenate([count + lanes * degree + j for j in range(degree)]).astype(np.int32)
    one = np.zeros(1, dtype=np.int64), np.array([degree], dtype=np.int32), np.array([count], dtype=np.int32)
    return points, Blocks(lanes.astype(np.int32), rings, *one, degree)


def visited(sweep, stars, *options, guard=None):
    """Where the centres (count, 2) are after sweep(points, blocks, 0, 1, guard, *options, tally), and the tally."""
    points, blocks = block_of(stars)
    tally = np.zeros(3, dtype=np.int64)
    sweep(points, blocks, 0, 1, guard or plain_guard(), *options, tally)
    return points[: len(stars)], tally

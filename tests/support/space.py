"""Blocks of random stars in space, and what the kernels see in them."""

from __future__ import annotations

from fractions import Fraction

import numba
import numpy as np

from gmsnet.kernels.star.space import derive, judge
from gmsnet.kernels.star.space_blocks import LANES3
from gmsnet.kernels.star.stars3 import certify3, fetch3, workspace3_for
from gmsnet.topology.ordering import space_points
from gmsnet.topology.volume import Volume
from support import volumes


@numba.njit(error_model="numpy")
def see(points, blocks, block, number, constants, step, floor, unit, grain, wall=None, squarings=0):
    """The workspace after a block has been fetched and derived, and one step (3, LANES3) judged and certified."""
    workspace = workspace3_for(blocks.most, blocks.most_simplices)
    rows = np.int64(blocks.simplices[block])
    fetch3(points, blocks, block, workspace)
    derive(
        workspace.local, blocks.spoke, blocks.at[block], rows, blocks.cells, block, number, constants, None,
        wall, squarings, workspace.kept, workspace.sums, None, None, None,
    )  # fmt: skip
    for k in range(3 * LANES3):
        workspace.step[k] = step[k]
    judge(
        workspace.kept, rows, blocks.cells, block, number, constants, None, workspace.step, floor, workspace.sums,
        blocks.at[block], wall, squarings, None, None, None,
    )  # fmt: skip
    certify3(workspace, unit, grain, None)
    return workspace


def stars(rng, around, make=volumes.ball, size=1.0, away=0.0, **options):
    """A mesh of one ball for each number of nodes around: (points (N, 4), topology), each of one colour."""
    points, cells, before = [], [], 0
    for k, count in enumerate(around):
        at, own = make(rng, count, **options)
        points.append(at + np.array([3.0 * k, 0.0, 0.0]))
        cells.append(own + before)
        before += len(at)
    everything = size * np.vstack(points) + away
    mesh = volumes.mesh_of(everything, np.vstack(cells))
    topology = Volume.of(mesh)
    assert len(topology.free) == len(around)
    return space_points(mesh)[topology.memory], topology


def simplices_of(topology, block, lane):
    """The places of the free node of a lane, and of the ends (F, 3) of the spokes of its simplices."""
    blocks = topology.stars.blocks
    count = blocks.cells[block * LANES3 + lane]
    begin = blocks.at[block]
    rows = blocks.spoke[begin : begin + 3 * LANES3 * blocks.simplices[block]].reshape(-1, 3, LANES3)[:count, :, lane]
    ring = blocks.ring[blocks.offset[block] :][: LANES3 * blocks.degree[block]].reshape(-1, LANES3)[:, lane]
    return blocks.centre[block * LANES3 + lane], ring[rows]


def as_written(part):
    """A formula for any numbers, fractions among them."""
    from gmsnet.kernels.jit.vectors import as_written

    return as_written(part)


def exact_margins(place, ends):
    """[(D, S)] of the simplices of a star in the arithmetic of the coordinates. ends: (F, 3, 3)."""
    found = []
    for corner in ends:
        spokes = [[e - p for e, p in zip(end, place, strict=True)] for end in corner]
        a, b, c = spokes
        found.append((determinant(*spokes), sum(squared(s) for s in (a, b, c, less(a, b), less(b, c), less(c, a)))))
    return found


def less(a, b):
    return [p - q for p, q in zip(a, b, strict=True)]


def squared(a):
    return sum(p * p for p in a)


def determinant(a, b, c):
    return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])


def exact(points):
    return [[Fraction(float(v)) for v in row] for row in np.atleast_2d(points)]


def above(double, lengths, floor):
    """Is D > c·S^(3/2), c a float that is not negative? Both squared."""
    return double > 0 and double * double > Fraction(floor) ** 2 * lengths**3

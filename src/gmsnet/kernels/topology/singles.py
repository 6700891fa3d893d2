"""The stars of blocks one after the other, as what has no lanes reads them."""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import LANES, inlined, kernel
from gmsnet.kernels.star.space_blocks import LANES3, is_present, rows_in


@kernel
def one_by_one(centre, rings, offset, degree, filled, centres, ring, offsets, degrees):
    """Writes the stars of blocks (see ``fill_blocks``) one after the other, the nodes around each together.

    centres, offsets, degrees: of each star; ring: the nodes around it from its offset on.
    """
    star = at = 0
    for b in range(len(degree)):
        n = np.int64(degree[b])
        for lane in range(filled[b]):
            centres[star], offsets[star], degrees[star] = centre[b * LANES + lane], at, n
            for j in range(n):
                ring[at + j] = rings[offset[b] + j * LANES + lane]
            star += 1
            at += n


@kernel
def sizes_in_space(blocks, degree, simplices):
    """How many nodes around, and simplices, each star of SpaceBlocks has of its own."""
    star = 0
    for b in range(len(blocks.filled)):
        for lane in range(blocks.filled[b]):
            n, low = np.int64(blocks.degree[b]), blocks.offset[b] + lane
            while n > 1 and blocks.ring[low + (n - 1) * LANES3] == blocks.ring[low]:
                n -= 1
            degree[star], simplices[star] = n, 0
            for k in range(rows_in(blocks.mixture, blocks, b, lane)):
                simplices[star] += is_present(blocks.mixture, blocks.at[b], k, lane)
            star += 1


@kernel
def one_by_one_in_space(blocks, single):
    """Writes the stars of SpaceBlocks into those of blocks of one, whose sizes and places are there."""
    star = 0
    for b in range(len(blocks.filled)):
        for lane in range(blocks.filled[b]):
            single.centre[star] = blocks.centre[b * LANES3 + lane]
            for j in range(single.degree[star]):
                single.ring[single.offset[star] + j] = blocks.ring[blocks.offset[b] + j * LANES3 + lane]
            to = single.at[star]
            for k in range(rows_in(blocks.mixture, blocks, b, lane)):
                if is_present(blocks.mixture, blocks.at[b], k, lane):
                    for j in range(3):
                        single.spoke[to + j] = blocks.spoke[blocks.at[b] + (3 * k + j) * LANES3 + lane]
                    note_cell(blocks.mixture, single.mixture, blocks.at[b] // 3, k, lane, to // 3)
                    to += 3
            note_edges(blocks.mixture, single.mixture, b * LANES3 + lane, star)
            star += 1


@inlined
def note_cell(mixture, single, at, k, lane, to):
    """Writes the role and the cell of the simplex in row k; at, to: where the rows begin, and where this one goes."""
    if mixture is not None:
        single.role[to] = mixture.role[at // LANES3 + k]
        single.owner[to] = mixture.owner[at + k * LANES3 + lane]


@inlined
def note_edges(mixture, single, place, star):
    """Writes how many edges a star has."""
    if mixture is not None:
        single.edges[star] = mixture.edges[place]

"""A block of stars: LANES of one colour and degree n, and the arrays that one is worked on in.

Coordinates stand as [node][lane][axis], flat, the free nodes first and then the rings: a pair is loaded and stored at
once. Stars of one colour share no cell.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import LANES, inlined, part
from gmsnet.kernels.jit.prefetch import prefetch
from gmsnet.kernels.star.pattern import Patterns

MOVED, TRUNCATED, DROPPED = range(3)  # what a sweep counts
COUNTERS = 32  # room for them on cache lines of their own, so that threads do not wait for each other's counts
# Rows of a block's work array. CENTRE, TARGET and KEPT have two, one an axis; PAIRS four, two [lane][axis]; FLOORS n.
SIZE, REACH, CENTRE, TARGET, MARGIN, SHARE, KEPT, PAIRS, FLOORS = 0, 1, 2, 4, 6, 7, 8, 10, 14
CORNERS = 12  # numbers behind all rows: the corners of a simplex, before a move and after it
LOWEST_MARGIN, WIDTH = range(2)  # rows of what a certificate is made of
FAR = 2**18  # nodes: the coordinates of more (4 MiB) do not stay in the second-level cache


class Blocks(NamedTuple):
    """The free nodes with the nodes around them, in blocks of LANES of one colour and degree, and one pattern (see
    kernels.topology.layout.fill_blocks).

    degree: how many nodes are around each free node of a block. filled: how many of the lanes hold stars of their own.
    most: the largest number of nodes or of simplices of a star. pattern: (B,) of each block, patterns: all there are
    (kernels.star.pattern); both None where all stars are fans.
    """

    centre: NDArray[np.int32]
    rings: NDArray[np.int32]
    offset: NDArray[np.int64]
    degree: NDArray[np.int32]
    filled: NDArray[np.int32]
    most: int
    pattern: NDArray[np.int32] | None = None
    patterns: Patterns | None = None


class Visit(NamedTuple):
    """A kernel that visits blocks of stars: called with points, blocks, first, last, guard, *arguments and tally.

    room: how many numbers for one star the longest of its own arrays has, but for those of its workspace and its ring;
    None where that is not told.
    """

    kernel: Callable[..., None]
    arguments: tuple[Any, ...] = ()
    room: int | None = 0


class Workspace(NamedTuple):
    """The arrays that a sweep works in. star: coordinates. work: rows of LANES, and CORNERS. sums: to certify."""

    star: NDArray[np.float64]
    work: NDArray[np.float64]
    sums: NDArray[np.float32]
    counts: NDArray[np.int64]


@part
def workspace_for(most):
    """For stars of up to so many nodes."""
    counts = np.empty(COUNTERS, dtype=np.int64)
    for k in range(COUNTERS):
        counts[k] = 0
    star, work = np.empty(2 * (1 + most) * LANES), np.empty((FLOORS + most) * LANES + CORNERS)
    return Workspace(star, work, np.empty(2 * LANES, dtype=np.float32), counts)


@part
def gather(points, blocks, block, n, star):
    """Coordinates of the stars of a block, as they stand now."""
    gather_row(points, blocks.centre[block * LANES : (block + 1) * LANES], star[: 2 * LANES])
    offset = blocks.offset[block]
    for j in range(n):
        nodes = blocks.rings[offset + j * LANES : offset + (j + 1) * LANES]
        gather_row(points, nodes, ring_row(star, j))


@part
def ask_ahead(points, blocks, block):
    """Has the coordinates that a block will gather fetched, if there is one, and a mesh of more than FAR nodes."""
    if len(points) > FAR and block < len(blocks.degree):
        low = blocks.offset[block]
        for k in range(low, low + LANES * blocks.degree[block]):
            prefetch(points, np.uint32(blocks.rings[k]))


@inlined
def gather_row(points, nodes, row):
    """x and y of a node, and so on."""
    for lane in range(LANES):
        i = np.uint32(nodes[lane])  # an index that may be negative is looked at twice
        x, y = points[i, 0], points[i, 1]
        row[2 * lane] = x
        row[2 * lane + 1] = y


@inlined
def ring_row(star, j):
    """The j-th ring nodes, [lane][axis]."""
    return star[2 * (j + 1) * LANES : 2 * (j + 2) * LANES]

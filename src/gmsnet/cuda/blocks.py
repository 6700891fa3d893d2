"""Stars as a GPU reads them: a thread for each, in blocks of one."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.star.block import Blocks
from gmsnet.kernels.star.space_blocks import SpaceBlocks
from gmsnet.kernels.topology.singles import one_by_one, one_by_one_in_space, sizes_in_space


class Singles(NamedTuple):
    """Stars in blocks of one. first: (C + 1,), where those of each colour begin."""

    blocks: Blocks | SpaceBlocks
    first: NDArray[np.int64]


def singles(blocks: Blocks | SpaceBlocks, first: NDArray[np.integer[Any]]) -> Singles:
    """first: (C + 1,) of the blocks. What lanes hold that repeat a star is left out."""
    begin = begins(blocks.filled)
    if isinstance(blocks, SpaceBlocks):
        return Singles(_in_space(blocks, int(begin[-1])), begin[first])
    count, around = int(begin[-1]), int(blocks.filled.astype(np.int64) @ blocks.degree)
    centre, degree = np.empty(count, dtype=np.int32), np.empty(count, dtype=np.int32)
    offset = np.empty(count, dtype=np.int64)
    ring, pattern = np.empty(around, dtype=np.int32), blocks.pattern
    one_by_one(blocks.centre, blocks.rings, blocks.offset, blocks.degree, blocks.filled, centre, ring, offset, degree)
    return Singles(
        Blocks(
            centre, ring, offset, degree, np.ones(count, dtype=np.int32), blocks.most,
            None if pattern is None else np.repeat(pattern, blocks.filled), blocks.patterns,
        ),
        begin[first],
    )  # fmt: skip


def begins(counts: NDArray[np.integer[Any]]) -> NDArray[np.int64]:
    """(C + 1,) where so many things begin that stand one after the other, and where the last ends."""
    begin = np.zeros(len(counts) + 1, dtype=np.int64)
    np.cumsum(counts, out=begin[1:])
    return begin


def _in_space(blocks: SpaceBlocks, count: int) -> SpaceBlocks:
    degree, simplices = np.empty((2, count), dtype=np.int32)
    sizes_in_space(blocks, degree, simplices)
    offset, rows = begins(degree), begins(simplices)
    mixture = blocks.mixture
    if mixture is not None:
        mixture = mixture._replace(
            role=np.empty(rows[-1], dtype=np.uint8), present=np.ones(rows[-1], dtype=np.uint16),
            owner=np.empty(rows[-1], dtype=np.int32), edges=np.empty(count, dtype=np.int32),
        )  # fmt: skip
    made = SpaceBlocks(
        np.empty(count, dtype=np.int32), np.empty(offset[-1], dtype=np.int32), offset[:-1], degree,
        np.empty(3 * rows[-1], dtype=np.uint8), 3 * rows[:-1], simplices, simplices, np.ones(count, dtype=np.int32),
        blocks.most, blocks.most_simplices, mixture,
    )  # fmt: skip
    one_by_one_in_space(blocks, made)
    return made

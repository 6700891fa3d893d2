"""Stars as a GPU reads them: a thread for each, in blocks of one."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import LANES
from gmsnet.kernels.star.block import Blocks


class Singles(NamedTuple):
    """The stars of ``Blocks`` in blocks of one. first: (C + 1,), where those of each colour begin."""

    blocks: Blocks
    first: NDArray[np.int64]


def singles(blocks: Blocks, first: NDArray[np.integer[Any]]) -> Singles:
    """first: (C + 1,) of the blocks. What lanes hold that repeat a star is left out."""
    lanes = np.arange(LANES)
    used = lanes < blocks.filled[:, None]
    begin = np.concatenate([[0], np.cumsum(blocks.filled, dtype=np.int64)])  # (B + 1,) of the stars of each block
    degree = np.repeat(blocks.degree, blocks.filled)
    offset = np.cumsum(degree, dtype=np.int64) - degree
    rings = np.empty(int(degree.sum()), dtype=np.int32)
    for n in np.unique(blocks.degree):
        some = np.flatnonzero(blocks.degree == n)
        rows = blocks.offset[some, None] + LANES * np.arange(n)
        nodes = blocks.rings[rows[:, :, None] + lanes]  # (some, n, LANES)
        stars = np.flatnonzero(degree == n)
        rings[offset[stars, None] + np.arange(n)] = nodes.transpose(0, 2, 1)[used[some]]
    return Singles(
        Blocks(
            blocks.centre.reshape(-1, LANES)[used], rings, offset, degree, np.ones(len(degree), dtype=np.int32),
            blocks.most, None if blocks.pattern is None else np.repeat(blocks.pattern, blocks.filled), blocks.patterns,
        ),
        begin[first],
    )  # fmt: skip

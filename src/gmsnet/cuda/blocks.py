"""Stars as a GPU reads them: a thread for each, in blocks of one."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.star.block import Blocks
from gmsnet.kernels.topology.layout import one_by_one


class Singles(NamedTuple):
    """The stars of ``Blocks`` in blocks of one. first: (C + 1,), where those of each colour begin."""

    blocks: Blocks
    first: NDArray[np.int64]


def singles(blocks: Blocks, first: NDArray[np.integer[Any]]) -> Singles:
    """first: (C + 1,) of the blocks. What lanes hold that repeat a star is left out."""
    begin = np.zeros(len(blocks.filled) + 1, dtype=np.int64)
    np.cumsum(blocks.filled, out=begin[1:])
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

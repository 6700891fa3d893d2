"""The stars of a mesh in blocks, and their colours."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.star.block import Blocks
from gmsnet.kernels.star.shell import ShellBlocks, ShellStars
from gmsnet.kernels.star.space_blocks import SpaceBlocks
from gmsnet.kernels.topology import connectivity
from gmsnet.topology.polygons import Offsets

Ints = NDArray[np.int32]


Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Stars:
    """The stars in blocks of one colour; those of colour c are first[c] … first[c + 1] − 1.

    In a plane a block has 64 stars of one degree, in space 16, on a surface 1.
    """

    blocks: Blocks | SpaceBlocks | ShellStars | ShellBlocks
    first: Ints

    @property
    def colours(self) -> int:
        """How many colours there are."""
        return len(self.first) - 1


@dataclass(frozen=True, eq=False)
class Colouring:
    """Greedy colours of the nodes at some places in memory, in this order; made when they are first asked for.

    start, ring: CSR by places in memory, the ring with WIDTH more (kernels.topology.connectivity). fewest: stars have
    at least so many colours, though some have no nodes.
    """

    places: Ints
    start: Offsets
    ring: Ints
    fewest: int = field(default=0, kw_only=True)

    @cached_property
    def colours(self) -> Ints:
        """(N,) by places in memory, −1 for all others."""
        colours = np.zeros(len(self.start) - 1, dtype=np.int32)
        if not connectivity.colour(self.places, self.start, self.ring, colours):
            colours[:] = -1
            connectivity.colour_many(self.places, self.start, self.ring, colours)
        return colours

"""The stars of a mesh in blocks, and their colours."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import LANES
from gmsnet.kernels.star import pattern as kernels
from gmsnet.kernels.star.block import Blocks
from gmsnet.kernels.star.shell import ShellBlocks, ShellStars
from gmsnet.kernels.star.space_blocks import LANES3, SpaceBlocks
from gmsnet.kernels.topology import connectivity, layout
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

    @classmethod
    def in_plane(cls, free: Ints, links: kernels.Stars, near_colours: Ints, fewest: int) -> Stars:
        """Those of the free nodes (F,) by places in memory. near_colours: (N,); fewest: as of Colouring."""
        numbers = links.pattern
        if links.patterns is None or numbers is None:
            kind = np.diff(links.start).take(free)
            most = int(kind.max(initial=0))
            sizes, pattern = np.arange(most + 1), None
        else:
            kind, pattern = numbers.take(free), links.patterns
            sizes = np.diff(pattern.row)
            most = int(max(sizes.max(initial=0), np.diff(pattern.first).max(initial=0)))
        colours, kinds = max(int(near_colours.max(initial=-1)) + 1, fewest), len(sizes)
        kind = near_colours.take(free) * kinds + kind
        number = -(-np.bincount(kind, minlength=colours * kinds).reshape(colours, kinds) // LANES)
        first, to = np.zeros((2, colours + 1), dtype=np.int64)
        np.cumsum(number.sum(axis=1), out=first[1:])
        np.cumsum(LANES * (number @ sizes), out=to[1:])
        blocks = int(first[-1])
        centre, rings = np.empty(blocks * LANES, dtype=np.int32), np.empty(to[-1], dtype=np.int32)
        offset, degree = np.empty(blocks, dtype=np.int64), np.empty(blocks, dtype=np.int32)
        filled = np.zeros(blocks, dtype=np.int32)
        layout.fill_blocks(
            free, links.start, links.around, kind, sizes, first[:-1].copy(), to[:-1], centre, rings, offset, degree,
            filled,
        )  # fmt: skip
        of_block = None if pattern is None or numbers is None else numbers[centre[::LANES]]
        return cls(Blocks(centre, rings, offset, degree, filled, most, of_block, pattern), first.astype(np.int32))

    @property
    def colours(self) -> int:
        """How many colours there are."""
        return len(self.first) - 1


def in_blocks(
    nodes: NDArray[np.int64], alike: NDArray[np.int64], colour: Ints, fewest: int
) -> tuple[Ints, NDArray[np.int64], NDArray[np.int64]]:  # fmt: skip
    """The stars of some nodes in space in blocks of LANES3 of one colour.

    nodes: (F,) by places in memory. alike, colour: (F,) stars of one number stand beside one another. fewest: as of
    Colouring. Returns their order (F,), where the stars of each block begin in it (B + 1,), and where the blocks of
    each colour begin.
    """
    order = nodes[np.lexsort((nodes, _short(alike), _short(colour)))].astype(np.int32)
    sizes = np.bincount(colour, minlength=max(int(colour.max(initial=-1)) + 1, fewest))
    blocks = -(-sizes // LANES3)
    of_colour = np.concatenate([[0], np.cumsum(blocks)])
    begin = np.concatenate([[0], np.cumsum(sizes)])[:-1]
    within = np.arange(of_colour[-1]) - np.repeat(of_colour[:-1], blocks)
    return order, np.append(np.repeat(begin, blocks) + LANES3 * within, len(order)).astype(np.int64), of_colour


def _short(keys: NDArray[Any]) -> NDArray[Any]:
    """The same in two bytes, if they fit: NumPy sorts these in linear time."""
    return keys.astype(np.uint16) if keys.max(initial=0) < 1 << 16 and keys.min(initial=0) >= 0 else keys


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

"""The connectivity of a surface in space, seen from its nodes: that of the plane, and on which side each cell shows."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.star import shell_simplices as kernels
from gmsnet.kernels.star.block import Blocks
from gmsnet.kernels.star.shell import ShellBlocks, ShellStars
from gmsnet.kernels.star.shell_simplices import ShellSimplices
from gmsnet.kernels.whole.jets import list_facets
from gmsnet.topology.stars import Flags, Ints, Stars
from gmsnet.topology.topology import Topology


@dataclass(frozen=True, eq=False, kw_only=True)
class Shell(Topology):
    """See the module. side: (S, 3) float32, the vector n of each row of ``near`` (kernels.star.shell); near_side: of
    those that are there now. first: (N + 1,) where the simplices of each star begin in star_side (M, 3).
    """

    near_side: NDArray[np.float32]
    first: NDArray[np.int64]
    star_side: NDArray[np.float32]

    @classmethod
    def made(cls, topology: Topology, side: NDArray[np.float32]) -> Shell:
        """Of a topology in no plane, and the vectors n (S, 3) of its rows."""
        stars = topology.links
        degree = np.diff(stars.start)
        if stars.patterns is None or stars.pattern is None:
            count = degree
        else:
            count = np.where(degree > 0, np.diff(stars.patterns.first)[stars.pattern], 0)
        first = np.zeros(len(degree) + 1, dtype=np.int64)
        np.cumsum(count, out=first[1:])
        begin, of_node = np.zeros(len(degree) + 2, dtype=np.int64), np.empty(topology.near.size, dtype=np.int32)
        list_facets(topology.near, begin, of_node)
        out = np.empty((first[-1], 3), dtype=np.float32)
        missing = kernels.list_sides(
            topology.near, topology.near_orientation, side, stars.start, stars.around, stars.pattern, stars.patterns,
            begin, of_node, first, out,
        )  # fmt: skip
        assert not missing
        kept = {name: getattr(topology, name) for name in Topology.__dataclass_fields__}
        return cls(**kept, near_side=side, first=first, star_side=out)

    @cached_property
    def simplices(self) -> ShellSimplices:  # type: ignore[override]
        """The corner simplices of all cells whose nodes may move, in memory order."""
        return ShellSimplices(self.near, self.near_orientation, self.near_shapes, self.near_cells, self.near_side)

    @cached_property
    def changeable(self) -> ShellSimplices:  # type: ignore[override]
        """Those of the cells that have a free node: a corner of a quad hangs on all four."""
        return self._around(self.near_free)

    def _around(self, active: Flags) -> ShellSimplices:
        rows = self.rows_at(active)
        if self.near_cells is not None:
            cells = np.zeros(int(self.near_cells.max(initial=-1)) + 1, dtype=bool)
            cells[self.near_cells[rows]] = True
            rows = np.flatnonzero(cells[self.near_cells]).astype(np.int32)
        return self.simplices if len(rows) == len(self.near) else self.simplices.take(rows)

    def restricted(self, active: Flags) -> Shell:
        """See Topology."""
        around = self._around(active)
        inner = replace(
            self, near=around.rows, near_orientation=around.orientation, near_shapes=around.shapes,
            near_cells=around.cells, near_side=around.side,
            free=np.sort(self.memory[np.flatnonzero(active)]), near_free=active,
        )  # fmt: skip
        inner.__dict__["changeable"] = inner.simplices  # all of them
        return inner

    def stars_of(self, nodes: Ints) -> ShellStars:
        """The stars of some free nodes, by places in memory, in this order."""
        stars = self.links
        most = int(np.diff(stars.start).max(initial=0))
        if stars.patterns is not None:
            most = max(most, int(np.diff(stars.patterns.first).max(initial=0)))
        return ShellStars(
            nodes, stars.start, stars.around, self.first, self.star_side, most, stars.pattern, stars.patterns
        )

    @cached_property
    def in_lanes(self) -> Stars | None:
        """The stars of the free nodes in blocks, of a surface of triangles alone."""
        if self.patterns is not None:
            return None
        planar = self.in_blocks()
        blocks = planar.blocks
        assert isinstance(blocks, Blocks)
        sides = np.empty(3 * len(blocks.rings), dtype=np.float32)
        kernels.arrange_sides(blocks, self.first, self.star_side, sides)
        return Stars(ShellBlocks(blocks, self.stars_of(blocks.centre), sides), planar.first)

    @cached_property
    def stars(self) -> Stars:
        """The stars of the free nodes, colour after colour."""
        free = np.flatnonzero(self.near_free).astype(np.int32)
        colour = self.near_colours[free]
        order = np.argsort(colour, kind="stable")
        count = np.bincount(colour, minlength=max(int(colour.max(initial=-1)) + 1, self.colouring.fewest))
        first = np.zeros(len(count) + 1, dtype=np.int32)
        np.cumsum(count, out=first[1:])
        return Stars(self.stars_of(free[order]), first)

"""What the connectivity of any mesh tells of its nodes: which may move, why others may not, and their order."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from gmsnet.topology.ordering import inverse
from gmsnet.topology.polygons import Ints

Flags = NDArray[np.bool_]
Kind = TypeVar("Kind", bound="Connectivity")


@dataclass(frozen=True, eq=False, kw_only=True)
class Connectivity:
    """The base of ``Topology`` and ``Volume``.

    held: reason → node ids, the first reason that applies. free: (F,) ids of the nodes that may move, ascending.
    memory: (N,) node ids in memory order. near_free: (N,) by places in memory, which nodes may move. starred: (N,)
    likewise, which have a star in the mesh that this is a part of; None: this is the whole mesh.
    """

    held: dict[str, NDArray[np.int64]]
    free: Ints
    memory: Ints
    near_free: Flags
    starred: Flags | None = None

    def holding(self: Kind, chosen: Flags, reason: str) -> Kind:
        """The same, with the free nodes among the chosen (N,) by id held for this reason."""
        newly = self.free[chosen[self.free]]
        if not len(newly):
            return self
        held = {**self.held, reason: newly.astype(np.int64)}
        free = self.near_free & ~chosen[self.memory]
        return replace(self, held=held, free=self.free[~chosen[self.free]], near_free=free)

    @cached_property
    def places(self) -> Ints:
        """(N,) the place in memory of each node by id."""
        return inverse(self.memory)

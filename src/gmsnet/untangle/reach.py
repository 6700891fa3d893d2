"""How far untangling may look: over the whole mesh, or over a part that was cut out of it around inverted cells."""

from __future__ import annotations

from dataclasses import dataclass

from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume
from gmsnet.untangle.patch import Flags


class BeyondReachError(Exception):
    """What is to be done depends on nodes or cells that are not here."""


@dataclass(frozen=True, eq=False)
class Reach:
    """free: how many free nodes the whole mesh has. edge: (N,) bool by places in memory, the free nodes beside nodes
    that may move in the whole mesh, but not here; None if this is the whole.

    As long as no node of the edge is chosen, all is as in the whole mesh: what is chosen hangs together.
    """

    free: int
    edge: Flags | None = None

    @classmethod
    def whole(cls, topology: Topology | Volume) -> Reach:
        """That of the whole mesh."""
        return cls(len(topology.free))

    def choose(self, nodes: Flags) -> None:
        """Raises BeyondReachError where some nodes (N, bool) that are to be moved lie at the edge."""
        if self.edge is not None and (nodes & self.edge).any():
            raise BeyondReachError

    def need_all(self) -> None:
        """Raises BeyondReachError where this is not the whole mesh."""
        if self.edge is not None:
            raise BeyondReachError

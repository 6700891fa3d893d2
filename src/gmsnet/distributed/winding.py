"""How the cells of a part are read: forwards or backwards."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gmsnet.kernels.topology.connectivity import MISMATCHED, NON_ORIENTABLE, ZERO_AREA
from gmsnet.topology.held import REASONS, reasons_in_space
from gmsnet.topology.mixed_volume import MixedVolume
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import MOST, Volume

UNREAD = NON_ORIENTABLE, ZERO_AREA, MISMATCHED  # what is told of whole parts of a mesh, or of facets of far cells


class Winding(NamedTuple):
    """How many cells are read forwards and how many backwards, and whether that cannot be told of some."""

    forth: int
    back: int
    unread: bool

    @classmethod
    def of(cls, topology: Topology | Volume) -> Winding:
        """Of the cells that are here."""
        reasons = reasons_in_space(MOST) if isinstance(topology, Volume) else REASONS
        if isinstance(topology, Topology):  # near, those of quads are turned already
            orientation = np.concatenate([topology.orientation, topology.quad_orientation])
        else:
            orientation = topology.orientation if isinstance(topology, MixedVolume) else topology.near_orientation
        unread = any(reasons[mark] in topology.held for mark in UNREAD if mark in reasons)
        return cls(int(np.count_nonzero(orientation > 0)), int(np.count_nonzero(orientation < 0)), unread)

    @property
    def alike(self) -> bool:
        """Are all cells read in one way?"""
        return not self.unread and not (self.forth and self.back)

    def reads(self, *, forth: bool) -> bool:
        """Are all cells read forwards, or all backwards?"""
        return self.alike and not (self.back if forth else self.forth)

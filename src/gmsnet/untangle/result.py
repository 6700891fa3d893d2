"""What untangling says about itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

ALL, PART, NOTHING = "all", "part", "nothing"
HELD = "all its nodes are held"
CORNER_HELD = "a corner of it is held with the nodes beside it"


class UntanglingStep(NamedTuple):
    """What was done: its name, how many nodes it moved about, sweeps (or iterations), cells then left to mend."""

    name: str
    nodes: int
    sweeps: int
    left: int


class StillInverted(NamedTuple):
    """A cell that is not untangled: its row in ``Topology.near``, of a quad the first, why, and where (x, y, in
    coordinates of the run)."""

    row: int
    reason: str
    place: tuple[float, float]


@dataclass(frozen=True, eq=False)
class Untangled:
    """points: (N, 2) in memory order. before, after: how many cells have a corner of zero area or less (exact signs).

    taken: ALL, PART or NOTHING of what was tried; why: if not all, what stood against it, else "". steps: what was
    done. unmended: the cells that are still inverted, or positive within rounding only, ascending.
    """

    points: NDArray[np.float64]
    before: int
    after: int
    taken: str
    why: str
    steps: tuple[UntanglingStep, ...]
    unmended: tuple[StillInverted, ...]

    @property
    def sweeps(self) -> int:
        """Sweeps and iterations of all steps."""
        return sum(step.sweeps for step in self.steps)

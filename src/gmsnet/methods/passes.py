"""How often the worst cells, and what follows them, have another turn, once others have made room for them."""

from __future__ import annotations

import math
from collections.abc import Sequence

from gmsnet.methods.phases import IN_SPACE, LARGE_VOLUME, LARGE_VOLUME_PLAN, SMALL_PLAN, SURFACE_PLAN, Phase
from gmsnet.methods.worst_first import WorstFirst

PASSES, LATE_PASSES = 8, 24  # at most; of volumes that gain LATE_GAIN still
LATE_GAIN = 0.005
# In the least 1/q: what a pass must gain for another one to follow; the last cycle of the first pass, on large meshes.
PASS_GAIN, LAST_GAIN = 0.002, 0.003
# Of meshes that are deformed as a whole the mean of 1/q is below this after sweeps on q: worst cells find room late.
DEFORMED = 0.89
LARGE_GAIN = 0.008  # of meshes in space of more than LARGE_VOLUME free nodes
LARGE_VOLUME_GAIN = 0.02  # of those of tetrahedra alone: with two turns they are at 98 % of what many reach


class Passes:
    """Those that were made of a plan, and the least 1/q after the last of them."""

    def __init__(self, phases: Sequence[Phase], free: int) -> None:
        self.gain, self.last, self.most = PASS_GAIN, 0.0, PASSES
        if phases in IN_SPACE and free > LARGE_VOLUME:
            self.gain = LARGE_VOLUME_GAIN if phases is LARGE_VOLUME_PLAN else LARGE_GAIN
        if phases in IN_SPACE and phases is not SURFACE_PLAN:
            self.most = LATE_PASSES
        elif phases not in IN_SPACE and phases is not SMALL_PLAN:
            self.last = LAST_GAIN
        self.made, self.least = 0, -math.inf

    def go_on(self, smoother: WorstFirst, mean: float) -> bool:
        """Is there another one? smoother: has just made one. mean: of 1/q after sweeps on q, NaN if unknown."""
        self.made += 1
        late = self.made >= PASSES
        gains = smoother.least >= self.least + (max(self.gain, LATE_GAIN) if late else self.gain)
        if self.made == 1 and self.last and not mean < DEFORMED:
            gains = smoother.gained >= self.last
        self.least = smoother.least
        return gains and self.made < self.most

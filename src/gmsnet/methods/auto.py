"""The default: each stage does what it is best at for its time, and the next one starts where it no longer pays.

- cheap sweeps: smart Laplacian ones, which take the mean of the ring only where Σq falls by it. Two bring most of what
  can be gained in the mean.
- Newton sweeps on the barrier Σq, which bring the rest and keep cells from collapsing.
- worst-first: the worst few cells alone, on high powers of q.

After each stage the mesh is measured; pairs of Newton sweeps go on as long as they bring more than GAIN in the mean of
1/q. What each stage is worth is measured by ``benchmarks/auto.py``. The variant ``patch`` leaves the cheap sweeps out;
it is what a target (``target_quality``, ``target_angle``) uses on the patches around the cells that miss it, which
others surround that are good as they are.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from gmsnet.kernels.stars import MOVED
from gmsnet.methods.barrier import Barrier
from gmsnet.methods.base import Field, Method, Smoother, Tally
from gmsnet.methods.laplacian import Laplacian
from gmsnet.methods.worst_first import WorstFirst
from gmsnet.standing import Standing
from gmsnet.workers import Share

GAIN = 0.004  # in the mean of 1/q: what the sweeps of a stage must bring to be made once more


class Stage(NamedTuple):
    """name: for the record. create: its smoother. sweeps: made before the next stage; None: until that has settled.

    repeats: whether it is made again as long as it gains.
    """

    name: str
    create: Callable[[], Smoother]
    sweeps: int | None
    repeats: bool = False


CHEAP = Stage("smart Laplacian", lambda: Laplacian("smart"), 2)
NEWTON = Stage("Newton on q", lambda: Barrier("q"), 2, repeats=True)
WORST = Stage("worst first", WorstFirst, None)

VARIANTS = {"full": (CHEAP, NEWTON, WORST), "patch": (NEWTON, WORST)}


class Auto(Smoother):
    """The stages one after the other."""

    idle_ends = False

    def __init__(self, stages: Sequence[Stage] = VARIANTS["full"]) -> None:
        self.stages = stages
        self.last: Standing | None = None  # at the last look
        self._enter(0)

    def _enter(self, stage: int) -> None:
        self.at, self.made = stage, 0
        self.smoother = self.stages[stage].create()

    def sweep(self, field: Field, share: Share, test: Callable[[], bool]) -> Tally:
        """See Smoother."""
        stage = self.stages[self.at]
        tally = self.smoother.sweep(field, share, test)
        self.stage = stage.name
        self.made += 1
        self.looks = self.made == stage.sweeps or self.smoother.settled or not tally[MOVED]
        return tally

    def told(self, standing: Standing) -> None:
        """Goes on to the next stage, or makes this one again, or settles."""
        last, self.last = self.last, standing
        if last is None:  # nothing is done yet
            return
        gains = standing.inverted < last.inverted or standing.mean_shape > last.mean_shape + GAIN
        if gains and self.stages[self.at].repeats:
            self.made = 0
        elif self.at + 1 < len(self.stages):
            self._enter(self.at + 1)
        else:
            self.settled = True


METHOD = Method(
    name="auto",
    summary="the default: cheap sweeps, then Newton's on a barrier, then the worst cells alone, while each pays",
    source="this package; docs/auto.md",
    create=lambda options: Auto(VARIANTS[options.variant]),
    variants=tuple(VARIANTS),
)

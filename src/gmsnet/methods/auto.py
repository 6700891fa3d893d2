"""The default: each stage does what it is best at for its time, and the next one starts where it no longer pays.

- cheap sweeps: smart Laplacian ones, which take the mean of the ring only where Σq falls by it. Two bring most of what
  can be gained in the mean.
- Newton sweeps on the barrier Σq², which bring the rest and keep cells from collapsing.
- worst-first: the worst few cells alone, on high powers of q.
- Newton sweeps on Σq: what the powers took from the mean for the worst cells comes back. The guard keeps the worst.

After each stage the mesh is measured; pairs of Newton sweeps go on as long as more than GAIN in the mean of 1/q is to
come, if it goes on as with the last two. What each stage is worth is measured by ``benchmarks/auto.py``. The variant
``patch`` leaves the cheap sweeps out; it is what a target (``target_quality``, ``target_angle``) uses on the patches
around the cells that miss it, which others surround that are good as they are.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

from gmsnet.kernels.stars import MOVED
from gmsnet.methods.barrier import Barrier
from gmsnet.methods.base import Field, Method, Smoother, Tally
from gmsnet.methods.laplacian import Laplacian
from gmsnet.methods.worst_first import CYCLES, WorstFirst
from gmsnet.standing import Standing
from gmsnet.workers import Share

RELAXATION, ALWAYS = 1.6, 10**9  # of the Newton steps, and for how many sweeps: where many are needed, it halves them
GAIN = 0.005  # in the mean of 1/q: what is to come for a stage to be made once more


class Stage(NamedTuple):
    """name: for the record. create: its smoother. sweeps: made before the next stage, unless it has settled before.

    rounds: how often at most, as long as it gains. looks: whether the mesh is measured after it.
    """

    name: str
    create: Callable[[], Smoother]
    sweeps: int
    rounds: int = 1
    looks: bool = True


CHEAP = Stage("smart Laplacian", lambda: Laplacian("smart"), 2, looks=False)
NEWTON = Stage("Newton on q²", lambda: Barrier("q2", RELAXATION, ALWAYS), 2, rounds=40)
WORST = Stage("worst first", lambda: WorstFirst(at_once=len(CYCLES)), 6)
MEAN = Stage("Newton on q", lambda: Barrier("q", RELAXATION, ALWAYS), 2)

VARIANTS = {"full": (CHEAP, NEWTON, WORST, MEAN), "patch": (NEWTON, WORST)}


class Auto(Smoother):
    """The stages one after the other."""

    idle_ends = False

    def __init__(self, stages: Sequence[Stage] = VARIANTS["full"]) -> None:
        self.stages = stages
        self.last: Standing | None = None  # at the last look
        self.gained = math.inf  # in the mean of 1/q by what was done between the last two looks
        self._enter(0)

    def _enter(self, stage: int) -> None:
        self.at, self.made, self.rounds, self.gained = stage, 0, 0, math.inf
        self.smoother = self.stages[stage].create()

    def sweep(self, field: Field, share: Share, test: Callable[[], bool]) -> Tally:
        """See Smoother."""
        stage = self.stages[self.at]
        tally = self.smoother.sweep(field, share, test)
        self.stage = stage.name
        self.made += 1
        done = self.made == stage.sweeps or self.smoother.settled or not tally[MOVED]
        self.looks = done and stage.looks
        if done and not stage.looks:
            self._enter(self.at + 1)
        return tally

    def told(self, standing: Standing) -> None:
        """Goes on to the next stage, or makes this one again, or settles."""
        stage, last, self.last = self.stages[self.at], self.last, standing
        if last is None:  # nothing is done yet
            return
        gained, before = standing.mean_shape - last.mean_shape, self.gained
        self.rounds += 1
        self.gained = gained if self.rounds > 1 else math.inf  # the first round's is the stages' before, too
        goes_on = self.rounds == 1 or standing.inverted < last.inverted or to_come(before, gained) > GAIN
        if self.rounds < stage.rounds and goes_on:
            self.made = 0
        elif self.at + 1 < len(self.stages):
            self._enter(self.at + 1)
        else:
            self.settled = True


def to_come(before: float, gained: float) -> float:
    """What is to be gained yet, if gains go on to fall by the same factor; by half, if only one is known."""
    if gained <= 0.0:
        return 0.0
    if before == math.inf:
        return gained
    return gained * gained / (before - gained) if gained < before else math.inf


METHOD = Method(
    name="auto",
    summary="the default: cheap sweeps, then Newton's on a barrier, then the worst cells alone, while each pays",
    source="this package; docs/auto.md",
    create=lambda options: Auto(VARIANTS[options.variant]),
    variants=tuple(VARIANTS),
)

"""The default: each phase does what it is best at for its time, and the next one starts where it no longer pays.

- Newton sweeps on the barrier Σq. The first takes the mean of the ring where Σq falls by it. They bring the mean of 1/q
  and keep cells from collapsing.
- worst-first: the worst few cells alone, on high powers of q.
- Newton sweeps on Σq again: what the powers took from the mean for the worst cells comes back. The guard keeps the
  worst cell.

On meshes of up to SMALL free nodes, where all this takes milliseconds, more is made of it: Newton sweeps go on as long
as there is anything to gain, and around the worst cells come sweeps of Newton's method on MetricLoss, for the mean,
with every cell kept above a floor.

Where nodes creep, many neighbours together one way (methods/creep.py), or much more is to come than the next rounds
will bring, the mesh is deformed as a whole: then all nodes move at once (methods/whole_mesh.py), and the phase goes on.
Then small meshes try powers of q at once, while no single cell is above the others. In the end, where the worst cells
are many alike, all nodes move at once for these, and all phases have another turn, as long as that gains.

A phase goes on as long as more than its ``gain`` in the mean of 1/q (of a sample of the cells) is to come, if gains go
on as the last two did. What each phase is worth is measured by ``benchmarks/auto.py``; see docs/auto.md.

For a target there is another plan (methods/for_target.py).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from gmsnet.kernels.star.block import MOVED
from gmsnet.kernels.star.guard import STAR
from gmsnet.methods.barrier import Barrier
from gmsnet.methods.base import ALL_CELLS, Field, Method, Smoother, Tally
from gmsnet.methods.creep import Creep
from gmsnet.methods.gains import Falling, mean_shape, to_come
from gmsnet.methods.passes import Passes
from gmsnet.methods.phases import IN_SPACE, SMALL_PLAN, Phase, plan_for
from gmsnet.methods.trial import Trial
from gmsnet.methods.whole_in_space import WholeInSpace
from gmsnet.methods.whole_mesh import CLOSEST, SETTLED, WholeMesh
from gmsnet.methods.worst_first import WorstFirst
from gmsnet.parallel.executor import Executor
from gmsnet.topology.mixed_volume import MixedVolume
from gmsnet.topology.shell import Shell
from gmsnet.topology.topology import Topology

SLOW = 0.02  # in the mean of 1/q: so much to come, by the last two gains, is more than sweeps should be left to bring
POOR = 0.5  # a mean of 1/q below this is not left to sweeps alone
FAIR = 0.8  # nor is one below this where they end
STILL_POOR = 0.85  # a mean of 1/q where a small mesh ends: its worst cells are among many like them
LOST = 0.02  # in the mean of 1/q: so much less than after sweeps on q is brought back where it can be
AHEAD = 50  # times the last gain are at most expected to come
# In the least 1/q, what a turn of all nodes for the worst cells must have gained for another, and for one after TURNS.
TURNS, TURN_GAIN, LATE_TURN_GAIN = 3, 0.01, 0.05
VERY_POOR, HOPELESS = 0.1, 1e-5  # between these a turn that doubled the least 1/q has another
COARSER = 10.0  # times what a phase must gain to go on, once these have been moved
MOST_ROUNDS = 100  # of a phase in which the sum of q falls
WHOLE, MOST_WHOLE = "whole mesh", 3  # times at most
WHOLE_WORST, POWERS, EARLY = "whole mesh, worst cells", (3, 2), (2, 3, 1)  # q⁸, q⁴, q²
GOOD, GOOD_MOVED = 0.75, 0.9  # a least 1/q that needs no more; the same on small meshes that were moved as a whole
FEW, FEW_QUADS = 256, 2000  # free nodes: so many have their turn in any case
FEW_SOLID = 1500  # the same of volumes that are not of tetrahedra alone
EXACT = 20_000  # free nodes: up to so many, all nodes of such a mesh go to the minimum of Σq, which is near
NEAR_MEAN = 0.06  # in 1/q: so little less than the mean is the least of a mesh of like cells


class Auto(Smoother):
    """The phases one after the other. Without any: those for the size of the mesh."""

    phases: Sequence[Phase]
    at: int
    made: int
    rounds: int
    gained: float
    converged: bool
    free: int
    smoother: Smoother
    mean: float
    phase: str
    looks: bool

    stops_when_idle = False
    shared_out = True

    def __init__(self, phases: Sequence[Phase] = ()) -> None:
        self.phases, self.at = phases, -1
        self.at_once = self.quads = self.solid = False  # may all nodes move at once? are there quads? is it in space?
        self.creep: Creep | None = None
        self.whole = 0  # how often all nodes have moved at once
        self.slow = self.ideal = self.early = self.doubled = False
        self.turns, self.least_before = 0, -math.inf  # how often all nodes had their turn for the worst cells
        self.passes: Passes | None = None
        self.trial: Trial | None = None
        self.again = -1  # the phase to go back to in the end, if there is one
        self.falling: Falling | None = None
        self.lost, self.mean_of_q = 0.0, math.nan  # of the mean of 1/q in the end, and what it was after sweeps on q
        self.restored = False

    def _enter(self, phase: int, field: Field, executor: Executor) -> None:
        if self.again >= 0 and (phase == len(self.phases) or (phase and self.phases[phase - 1].between)):
            phase, self.again = self.again, -1
        elif phase < len(self.phases) and self.phases[phase].between and self.again < 0:
            phase += 1
        self.at, self.made, self.rounds, self.gained = phase, 0, 0, math.inf
        if phase == len(self.phases):
            enough = TURN_GAIN if self.turns < TURNS else LATE_TURN_GAIN
            self.doubled = self.least < VERY_POOR and self.least > max(2.0 * self.least_before, HOPELESS)
            gained = self.turns == 0 or self.doubled or self.least >= self.least_before + enough
            ends = not gained or not (self.ideal or self._is_even(field, executor))
            self.turns, self.least_before = self.turns + 1, self.least
            if self.trial is not None:
                self.looks, self.trial = self.trial.ends(field, executor), None
                ends |= not self.looks
            if ends:
                self._end(field, executor)
            return
        self.smoother = self.phases[phase].create()
        self.falling = Falling(self.phases[phase].falling) if self.phases[phase].falling else None
        if self.phases[phase].rounds > 1 and not self.phases[phase].first:  # what those gain at first does not count
            self.mean = mean_shape(field, executor)

    def _end(self, field: Field, executor: Executor) -> None:
        """Ends, if the mean has not lost more than the phases bring back to planar meshes when they begin anew."""
        if not math.isnan(self.mean_of_q):
            self.lost = self.mean_of_q - mean_shape(field, executor)
        self.converged = self.restored or not self.at_once or self.lost < LOST
        if not self.converged:
            self.restored, self.whole = True, 0
            self._enter(0, field, executor)

    def sweep(self, field: Field, executor: Executor, test: Callable[[], bool]) -> Tally:
        """See Smoother."""
        if self.at < 0:
            self.free = int(executor.total(np.array(len(field.topology.free))))
            planar = isinstance(field.topology, Topology) and not isinstance(field.topology, Shell)
            self.at_once = not self.phases and field.level != STAR and planar
            self.quads = self.at_once and bool(executor.total(np.array(int(field.planar.near_shapes is not None))))
            self.creep = Creep.of(field, executor) if self.at_once else None
            self.solid = not self.phases and field.level != STAR and isinstance(field.topology, MixedVolume)
            own, self.phases = self.phases, self.phases or plan_for(field.topology, self.free)
            repeats = self.phases in IN_SPACE or not (own or field.level == STAR)
            self.passes = Passes(self.phases, self.free) if repeats else None
            self._enter(0, field, executor)
        if self.at == len(self.phases):
            return (self._move_all if self.ideal else self._move_all_for_worst)(field, executor, test)
        phase = self.phases[self.at]
        if self.early:
            return self._move_all_early(field, executor, test)
        if self.slow:
            return self._move_all(field, executor, test)
        watched = self.creep if phase.rounds > 1 and self.made + 1 == self._wanted else None
        if watched is not None:
            watched.start(field.points)
        tally = self.smoother.sweep(field, executor, test)
        self.phase = phase.name
        self.made += 1
        self.looks = False
        if self.made == self._wanted or self.smoother.converged or not tally[MOVED]:
            self._end_round(field, executor)
        return tally

    @property
    def least(self) -> float:
        """The least 1/q after the last pass over the worst cells."""
        return -math.inf if self.passes is None else self.passes.least

    @property
    def _wanted(self) -> int:
        """How many sweeps this round has."""
        phase = self.phases[self.at]
        return phase.first if phase.first and not self.rounds else phase.sweeps

    def _move_all(self, field: Field, executor: Executor, test: Callable[[], bool]) -> Tally:
        """All nodes at once; then the phase goes on as if it began."""
        self.slow, self.looks, self.phase = False, False, WHOLE
        self.whole += 1
        self.converged = self.ideal
        tally = WholeMesh(settled=CLOSEST if self.ideal else SETTLED).sweep(field, executor, test)
        if tally[MOVED]:
            self.rounds, self.made, self.gained = 0, 0, math.inf
            self.mean = mean_shape(field, executor)
        else:
            self.whole = MOST_WHOLE
        return tally

    def _move_all_early(self, field: Field, executor: Executor, test: Callable[[], bool]) -> Tally:
        """All nodes at once on powers of q while the floor is low: where all cells are alike, q̂ may gain by that."""
        self.early, self.looks, self.phase = False, True, WHOLE_WORST
        tally = np.zeros(3, dtype=np.int64)
        for power in EARLY:
            tally += WholeMesh((power,), best=True).sweep(field, executor, test)
        self._enter(self.at + 1, field, executor)
        return tally

    def _move_all_for_worst(self, field: Field, executor: Executor, test: Callable[[], bool]) -> Tally:
        """All nodes at once, for the worst cells; then all phases have another turn for the mean."""
        self.looks, self.phase = True, WHOLE_WORST
        if self.solid:
            self.trial = Trial.of(field, executor)
            self.looks = False
        whole = WholeInSpace(POWERS) if self.solid else WholeMesh(POWERS)
        tally = whole.sweep(field, executor, test)
        if tally[MOVED] or self.doubled:
            self._enter(0, field, executor)
        else:
            self._end(field, executor)
        return tally

    def _is_even(self, field: Field, executor: Executor) -> bool:
        """May the worst cell be one of many like it, which one star at a time cannot better?"""
        if self.solid:
            return self.free <= FEW_SOLID and self.least < GOOD_MOVED
        small, moved = self.phases is SMALL_PLAN, self.whole > 0
        fewest = small and self.free <= (FEW_QUADS if self.quads else FEW)
        if not self.at_once or self.least >= (GOOD_MOVED if small and (moved or fewest) else GOOD):
            return False
        if fewest:  # it takes little time
            return True
        mean = mean_shape(field, executor)
        return (small and (moved or mean < STILL_POOR)) or ((small or moved) and self.least > mean - NEAR_MEAN)

    def _is_slow(self, field: Field, executor: Executor, ahead: float, lasts: bool) -> bool:
        """Is the mesh deformed as a whole? ahead: what is to come in the mean of 1/q. lasts: gains do not fall fast."""
        if self.creep is None or self.whole >= MOST_WHOLE:
            return False
        creeps = self.creep.is_one(field.points, executor)
        return (lasts and (ahead > SLOW or creeps)) or (self.mean < POOR and not self.whole)

    def _is_caught(self) -> bool:
        """Have sweeps ended where the mesh may be folded? Moves of single nodes do not unfold it."""
        return self.creep is not None and not self.whole and self.mean < FAIR

    def _end_round(self, field: Field, executor: Executor) -> None:
        """Makes the phase once more where that pays, else goes on to the next one, or settles."""
        phase = self.phases[self.at]
        self.rounds += 1
        self.made = 0
        goes_on = False
        if self.rounds < phase.rounds:
            mean, ahead, lasts = mean_shape(field, executor), 0.0, True
            if phase.first and self.rounds == 1:
                goes_on = True
            else:
                before, self.gained = self.gained, mean - self.mean
                lasts = not phase.lasting or self.gained >= phase.lasting * before
                ahead = to_come(before, self.gained)
                enough = phase.gain * (COARSER if self.turns or self.whole else 1.0)
                goes_on = ahead > enough and self.gained > phase.least
                ahead = min(ahead, AHEAD * self.gained) if before < math.inf else 0.0
            self.mean = mean
            self.slow = self._is_slow(field, executor, ahead, lasts) or (not goes_on and self._is_caught())
            goes_on = goes_on or self.slow
        falling = self.falling
        if falling is not None and falling.goes_on(field, executor) and not goes_on and self.rounds < MOST_ROUNDS:
            goes_on = True
            if falling.slowly and isinstance(self.smoother, Barrier):
                self.smoother.hasten()
                falling.long = True
        target_reached = self.smoother.target_reached
        if isinstance(self.smoother, WorstFirst) and self.passes is not None:
            self.again = self.at if self.passes.go_on(self.smoother, self.mean_of_q) else -1
        looks = phase.looks and not (phase.late and self.again >= 0)
        self.looks = self.rounds % phase.often == 0 if goes_on else looks or target_reached
        self.looks &= self.trial is None
        if not goes_on:
            if falling is not None or (self.at_once and not self.at):
                mean = self.mean if self.rounds < phase.rounds else mean_shape(field, executor)
                self.mean_of_q = float(np.fmax(self.mean_of_q, mean))
            is_ideal = isinstance(self.smoother, WorstFirst) and self.smoother.least >= self.smoother.enough
            few = self.creep is not None and not self.whole and self.free <= EXACT
            self.ideal = is_ideal and few
            moved = self.at == 0 and self.whole > 0 and self.phases is SMALL_PLAN
            self.early = moved and not self.quads
            if self.early:
                return
            self._enter(len(self.phases) if target_reached or is_ideal else self.at + 1, field, executor)


METHOD = Method(
    name="auto",
    summary="the default: Newton's method on a barrier, then the worst cells alone, then the mean, while each pays",
    source="this package; docs/auto.md",
    create=lambda options: Auto(),
    slides=True,
    surfaces=True,
    cells=ALL_CELLS,
)

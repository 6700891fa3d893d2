"""The cells of a volume behind those that cannot become better: sweeps over the rest, which has a worst of its own.

Some cells are as good as held nodes let them be. With the worst of these as that of the mesh, sweeps over the worst
cells end early, and the guard keeps the others from nothing. So such cells are set aside step by step, nodes and all,
until the worst of the rest are many alike; then the default method goes over the rest.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import LANES
from gmsnet.kernels.methods.barrier3 import K3
from gmsnet.kernels.simplex.mean_ratio3 import Tetrahedra
from gmsnet.kernels.star.guard import LEVELS
from gmsnet.kernels.star.surface import Surface, locate3
from gmsnet.kernels.topology import connectivity
from gmsnet.measure.dihedral import ratios_of
from gmsnet.measure.totals import Totals, totals_of
from gmsnet.methods.auto import Auto
from gmsnet.methods.base import Field
from gmsnet.methods.worst_in_space import WorstInSpace
from gmsnet.parallel.executor import Executor
from gmsnet.run.dihedral_stage import ended_of_itself, with_sweep
from gmsnet.run.options import SmoothOptions
from gmsnet.run.run import Run, Start
from gmsnet.run.state import State
from gmsnet.run.stop import MAX_SWEEPS
from gmsnet.topology.volume import Volume

Floats = NDArray[np.float64]

PHASE = "the rest"
SHARE, FEWEST = 0.005, 12  # of the cells: the worst of the rest, which are to be alike
# In 1/η: by so much the worst cells of a mesh are apart, those of the rest are alike, and are set aside at a time.
APART, ALIKE, STEP = 1.3, 1.1, 1.25
ROUNDS, TIMES = 16, 3
SOME, ROUNDED = 8, 1.0 + 1e-9  # one in so many blocks of cells is looked at first; for the rounding of an η
GAIN = 0.005  # in the least η of the rest: with less the mesh stays as it was


def improve_rest(state: State, options: SmoothOptions, executor: Executor) -> State:
    """Smooths what lies behind the worst cells where ``auto`` has ended of itself and these are few and apart; and
    what lies behind the worst of that, TIMES at most."""
    for _ in range(TIMES):
        before, state = state, _once(state, options, executor)
        if state is before or not ended_of_itself(state, options):
            break
    return state


def _once(state: State, options: SmoothOptions, executor: Executor) -> State:
    if not ended_of_itself(state, options):
        return state
    rest = _set_aside(state, LEVELS.index(options.guard), executor)
    if rest is None:
        return state
    outer, executor = executor, executor.of(rest)
    before = _totals(state.points, rest, executor)
    start = Start(rest, state.points, state.precision, None, state.history, state.constraint, state.curved)
    run = Run(start, Auto(), replace(options, callback=None), executor)
    reason = run.to_the_end()
    if run.interruption is not None:
        return state.interrupted(run.interruption)
    if _totals(run.best, rest, executor).shape_min < before.shape_min + GAIN:
        return state
    own = run.history[len(state.history) :]
    tally = np.array([[sweep.moved, sweep.truncated, sweep.dropped] for sweep in own]).sum(axis=0)
    sweeps = own[-1].index - state.history[-1].index  # there are some, or nothing would have been gained
    state = with_sweep(replace(state, rest=rest), options, run.best, None, PHASE, tally, sweeps, executor=outer)
    return state.ended(reason) if reason == MAX_SWEEPS else state


def _set_aside(state: State, level: int, executor: Executor) -> Volume | None:
    """The connectivity with the nodes of few cells held, behind which the worst are many alike; None if they are so
    already, or if all nodes would have to be held.

    Which cells these are is found by sweeps over the worst cells of what is left, whose points are forgotten: around
    cells that are set aside, what high powers took from the mean would never come back.
    """
    points, topology = state.points.copy(), state.rest or state.topology
    assert isinstance(topology, Volume)
    if isinstance(state.constraint, Surface):
        locate3(state.constraint, points)
    outer = executor.of(topology)
    cells, rest, alike = topology.changeable, None, ALIKE if state.rest else APART
    if state.rest is None and state.totals is not None and _are_alike(points, cells, state.totals, outer):
        return None
    topology.forget_stars()  # sweeps over all of it have ended
    aside = np.isinf(ratios_of(points, cells, outer))
    if outer.counted(aside):  # with inverted cells in the mesh, sweeps keep nothing of the others
        alike = 0.0
    for _ in range(ROUNDS):
        ratios = ratios_of(points, cells, outer)
        ratios[aside] = 0.0
        limit = _limit(ratios, alike**3, outer)
        if limit == math.inf:
            break
        alike = ALIKE
        aside |= ratios > limit
        free = topology.near_free.copy()
        free[cells.rows[aside]] = False
        if not executor.total(np.array(np.count_nonzero(free))):
            return None
        everywhere = free.astype(np.float64)
        executor.exchange(everywhere)
        active = everywhere > 0.0
        still = np.ones(len(aside), dtype=bool)  # cells without a node that may move have no say any more
        still[connectivity.touching(cells.rows, active)] = False
        aside |= still
        rest = None  # the memory of the last one first
        rest = executor.restricted(topology, active)
        field = Field(points, rest, state.precision, level, constraint=state.constraint)
        WorstInSpace().sweep(field, executor.of(rest), lambda: False)
    return rest


def _are_alike(points: Floats, cells: Tetrahedra, totals: Totals, executor: Executor) -> bool:
    """Is it certain from some of the cells that the worst are many alike? Most often these are enough."""
    if totals.uncertain:
        return False
    every = executor.counted(np.ones(len(cells.rows), dtype=bool))
    limit = ROUNDED * K3 / (APART * totals.shape_min) ** 3
    some = executor.every(SOME, len(cells.rows), LANES)
    beyond = np.count_nonzero(ratios_of(points, cells.take(some), executor) >= limit)
    return int(executor.total(np.array(beyond))) >= min(max(FEWEST, math.ceil(SHARE * every)), every)


def _limit(ratios: Floats, alike: float, executor: Executor) -> float:
    """1/η³ above which cells are set aside; infinity, where the worst are many alike. alike: a factor of it."""
    every = executor.counted(np.ones(len(ratios), dtype=bool))
    count = min(max(FEWEST, math.ceil(SHARE * every)), every)
    many = executor.minimum(float(ratios[executor.lowest_rows(-ratios, count)].min(initial=math.inf)))
    most = -executor.minimum(-float(ratios.max(initial=0.0)))
    return math.inf if most <= alike * many else max(most / STEP**3, ALIKE**3 * many)


def _totals(points: Floats, topology: Volume, executor: Executor) -> Totals:
    totals = totals_of(points, topology.scored, executor)
    assert totals is not None
    return totals

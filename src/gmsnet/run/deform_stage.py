"""The stage that moves boundaries: the inside follows in as few steps as leave no cell inverted, and is smoothed where
shapes have suffered.

A step that cannot be had (run/journey.py) is halved.
"""

from __future__ import annotations

from dataclasses import replace

from gmsnet.measure.totals import totals_of
from gmsnet.methods.sized import Sized
from gmsnet.motion.prescribed import Prescribed
from gmsnet.parallel.executor import Executor
from gmsnet.run.journey import Journey, Step
from gmsnet.run.options import SmoothOptions
from gmsnet.run.score import Score
from gmsnet.run.state import Motion, State
from gmsnet.run.stop import CALLBACK, IN_PLACE, INTERRUPTED, NOT_IN_PLACE
from gmsnet.run.sweep import Sweep
from gmsnet.run.sweep_stage import sweep
from gmsnet.run.wall_stage import improve_near_walls

SHORTEST = 1.0 / 128.0  # of the way: a step
BETWEEN = 30  # sweeps after a step that is not the last
CARRIED = "carried along, its shape kept"


def move_boundary(state: State, options: SmoothOptions, executor: Executor, prescribed: Prescribed) -> State:
    """The mesh with its boundary as far on its way as no cell is inverted, smoothed where shapes have suffered."""
    journey = Journey(state, prescribed)
    attitude, motion, length = journey.rotations.still(len(state.points)), Motion(), 1.0
    try:
        while motion.fraction < 1.0 and length >= SHORTEST and state.stop_reason not in (CALLBACK, INTERRUPTED):
            share = min(1.0, motion.fraction + length)
            shares = motion.fraction, share
            step = journey.step(state, attitude, shares, executor if options.untangle else None)
            if step.why:
                if journey.rails is not None:
                    journey.rails.locate(journey.places_of(state.points))
                motion, length = replace(motion, reason=step.why), length / 2.0
                continue
            attitude = step.attitude
            motion = Motion(share, motion.steps + 1, motion.reason if share < 1.0 else "")
            state = _looked_at(state, step, motion, options, executor)
            if options.callback is not None and options.callback(state.history[-1]):
                state = state.ended(CALLBACK)
                break
            most = options.max_sweeps if share == 1.0 else min(BETWEEN, options.max_sweeps)
            state = _smoothed(state, journey, replace(options, max_sweeps=state.history[-1].index + most), executor)
    except KeyboardInterrupt as interruption:
        state = state.interrupted(interruption)
    if motion.fraction < 1.0:
        stopped = state.stop_reason in (CALLBACK, INTERRUPTED)
        state = replace(state, motion=replace(motion, reason=state.stop_reason) if stopped else motion)
        return state if stopped else state.ended(NOT_IN_PLACE)
    return state


def _looked_at(state: State, step: Step, motion: Motion, options: SmoothOptions, executor: Executor) -> State:
    """The state after a step, with its record."""
    totals = totals_of(step.points, state.topology.scored, executor)
    score = Score.of(totals, options.best_by)
    index = state.history[-1].index if state.history else 0
    moved = int((step.points != state.points).any(axis=1).sum())
    look = Sweep(
        index, f"moving, {motion.fraction:.4g} of the way", moved, 0, 0, score.inverted, score.qhat, score.min_shape,
        score.mean_shape,
    )  # fmt: skip
    return replace(
        state, points=step.points, totals=None, motion=motion, history=(*state.history, look), stop_reason=IN_PLACE,
        untangling=(*state.untangling, *([step.note] if step.note else [])),
    )  # fmt: skip


def _smoothed(state: State, journey: Journey, options: SmoothOptions, executor: Executor) -> State:
    """The state smoothed where shapes have suffered."""
    region = journey.region(state.points)
    protection = state.protection
    if not region[protection.topology.free].any():
        return state
    within = replace(protection, base=protection.base.holding(~region, CARRIED))
    smoother = options.smoother()
    if isinstance(smoother, Sized):
        smoother.start = state.start
    done = sweep(replace(state, protection=within, smoother=smoother), options, executor)
    near_walls = protection.near_walls is not None and (region & protection.near_walls).any()
    if near_walls and done.interruption is None:
        done = improve_near_walls(done, options, executor)
    return replace(done, protection=protection, released=False, totals=None)  # those were of the region

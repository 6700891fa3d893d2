"""The stage that moves boundaries: the inside follows in as few steps as leave no cell inverted, and is smoothed where
shapes have suffered.

Each step begins from the mesh as it is, but layers and cells near refined walls always follow from the input, so that
they do not wear from step to step. A step that inverts cells is mended by untangling, with layers held as they were
carried, else with their nodes let go; if that fails, it is halved.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from gmsnet.constraints.sliding import REASON
from gmsnet.kernels.simplex.mean_ratio2 import WEIGHTS
from gmsnet.kernels.whole.powers import shape_of_each
from gmsnet.measure.signs import exact_signs
from gmsnet.measure.totals import totals_of
from gmsnet.methods.sized import Sized
from gmsnet.motion.path import Complex, Flags, Floats, Path, as_complex, as_points
from gmsnet.motion.prescribed import Prescribed
from gmsnet.motion.rigid import Follower
from gmsnet.parallel.executor import Executor
from gmsnet.parallel.memory import refuse_unless_free
from gmsnet.run.options import SmoothOptions
from gmsnet.run.score import Score
from gmsnet.run.state import Motion, State
from gmsnet.run.stop import CALLBACK, IN_PLACE, INTERRUPTED, NOT_IN_PLACE
from gmsnet.run.sweep import Sweep
from gmsnet.run.sweep_stage import sweep
from gmsnet.run.wall_stage import improve_near_walls
from gmsnet.topology.topology import Topology
from gmsnet.untangle.cells import first_rows, whole_cells
from gmsnet.untangle.result import StillInverted

SHORTEST = 1.0 / 128.0  # of the way: a step
SUFFERED = 0.8  # of its 1/q in the input: a cell that has less is smoothed
SLIGHTLY = 0.98  # the same of cells that are worse than the worst one of the input
RINGS = 6  # around such cells
BETWEEN = 30  # sweeps after a step that is not the last
CARRIED = "carried along, its shape kept"
FARTHEST = 2.0**100  # from the origin, in units of the run: products of coordinates must not overflow
BYTES_PER_NODE = 2500  # of factors and edges, measured


@dataclass(frozen=True, eq=False)
class Step:
    """What came of a step. points: (N, 2), turned: (N,); why: what stood against it, "" if nothing. note: of
    untangling."""

    points: Floats
    turned: Floats
    why: str = ""
    note: str = ""


class Journey:
    """What stays the same on the way.

    held: the topology in which nodes that are moved, and those that slide, stand still. wrong: (T,) rows of cells that
    were not positive when the boundary began to move; shapes: (T,) 1/q then; least: the minimum.
    """

    slides: Flags | None
    held: Topology
    path: Path
    start: Complex
    follower: Follower
    wrong: Flags
    shapes: Floats
    least: float

    def __init__(self, state: State, prescribed: Prescribed) -> None:
        base = state.protection.base
        assert isinstance(base, Topology)
        self.slides = None if state.sliding is None else state.sliding.nodes
        self.held = base if self.slides is None else base.holding(self.slides, REASON)
        refuse_unless_free(BYTES_PER_NODE * len(base.free), f"moving the nodes around {len(base.free):,}")
        self.path = Path.of(prescribed, self.held, state.start, state.mesh.exponent)
        self.start = as_complex(state.points)
        kept = np.zeros(len(self.start), dtype=bool)
        for nodes in (state.protection.layers, state.protection.near_walls):
            if nodes is not None:
                kept |= nodes[base.memory]
        self.follower = Follower.of(self.held, self.start, self.path.end != self.path.start, kept)
        self.wrong = self.inverted(state.points)
        self.shapes = self.shape(state.points)
        self.least = float(self.shapes.min(initial=1.0))

    def inverted(self, points: Floats) -> Flags:
        """(T,) all rows of the cells that have a corner of no positive area."""
        topology = self.held
        return whole_cells(topology, exact_signs(points, topology.near, topology.near_orientation) <= 0)

    def shape(self, points: Floats) -> Floats:
        """(T,) 1/q of each corner simplex."""
        topology, simplices = self.held, self.held.simplices
        cells = np.where(topology.near_orientation[:, None] > 0, topology.near, topology.near[:, [0, 2, 1]])
        table = None if simplices.shapes is None else WEIGHTS[simplices.shapes]
        out = np.empty(len(cells))
        shape_of_each(points, np.ascontiguousarray(cells), table, out)
        return out

    def step(self, state: State, turned: Floats, share: float, *, untangling: bool) -> Step:
        """The mesh with the boundary at a share of its way."""
        places = self.path.places(share)
        if why := self.crossing(state, places):
            return Step(state.points, turned, why)
        now = as_complex(state.points)
        a, b = self.follower.edges.T
        unturned = np.exp(-0.5j * (turned[a] + turned[b])) * (now[b] - now[a])
        layers = self.follower.layers
        unturned[layers] = (self.start[b] - self.start[a])[layers]
        with np.errstate(over="ignore", invalid="ignore"):
            found, turned = self.follower.follow(now, turned, unturned, places, self.path.turns(share), self.path.sure)
        points = _rounded(found, places, self.follower.free, single=state.precision.single)
        if not (np.abs(points) < FARTHEST).all():
            return Step(state.points, turned, "places would be too far away for their digits")
        if not (self.inverted(points) & ~self.wrong).any():
            return Step(points, turned)
        if not untangling:
            return Step(points, turned, "cells were inverted")
        return self.untangled(state, Step(points, turned))

    def untangled(self, state: State, step: Step) -> Step:
        """The step with no cell inverted that was not at first, if that can be had."""
        from gmsnet.untangle import untangle

        protection, why = state.protection, ""
        levels = [protection.topology, protection.outer, protection.base]
        if self.slides is not None:
            levels = [topology.holding(self.slides, REASON) for topology in levels]
        for topology in dict.fromkeys(levels):
            assert isinstance(topology, Topology)
            done = untangle(step.points, topology, state.precision)
            rest = self.inverted(done.points) & ~self.wrong
            if not rest.any():
                steps = ", ".join(f"{each.name} ({each.sweeps})" for each in done.steps)
                let_go = "" if topology is levels[0] else "; nodes of layers or near walls were let go for that"
                note = f"untangling: all {done.before:,} inverted cells mended; {steps}{let_go}"
                return replace(step, points=done.points, note=note)
            why = self._why(state, topology, rest, {cell.row: cell for cell in done.unmended})
        return replace(step, why=why)

    def _why(self, state: State, topology: Topology, rest: Flags, known: Mapping[int, StillInverted]) -> str:
        rows = first_rows(topology, rest)
        cell = topology.cells_of(rows[:1])[0]
        count = f"{len(rows):,} cells" if len(rows) > 1 else "1 cell"
        told = known.get(int(rows[0]))
        where = ""
        if told is not None:
            where = f": {told.reason}, at {_place(complex(*told.place), state.mesh.exponent)}"
        return f"{count} would be inverted, first cell {cell}{where}"

    def crossing(self, state: State, places: Complex) -> str:
        """Where boundaries cross that did not at first, in words; "" if they do not."""
        from gmsnet.untangle.crossings import crossings_of

        found = crossings_of(as_points(places), self.path.edges)
        if not len(found) or len(crossings_of(as_points(self.path.start), self.path.edges)):
            return ""
        return f"boundaries would cross each other at {_place(complex(*found[0]), state.mesh.exponent)}"

    def region(self, points: Floats) -> Flags:
        """(N,) by id: nodes of cells whose shapes have suffered, and those around."""
        topology, rows = self.held, self.held.near
        now = self.shape(points)
        worse = (now < self.least) & (now < SLIGHTLY * self.shapes)
        bad = whole_cells(topology, worse | (now < SUFFERED * self.shapes))
        chosen = np.zeros(len(points), dtype=bool)
        chosen[rows[bad]] = True
        for _ in range(RINGS if bad.any() else 0):
            chosen[rows[chosen[rows].any(axis=1)]] = True
        by_id = np.empty_like(chosen)
        by_id[topology.memory] = chosen
        return by_id


def move_boundary(state: State, options: SmoothOptions, executor: Executor, prescribed: Prescribed) -> State:
    """The mesh with its boundary as far on its way as no cell is inverted, smoothed where shapes have suffered."""
    journey = Journey(state, prescribed)
    turned, motion, length = np.zeros(len(state.points)), Motion(), 1.0
    try:
        while motion.fraction < 1.0 and length >= SHORTEST and state.stop_reason not in (CALLBACK, INTERRUPTED):
            share = min(1.0, motion.fraction + length)
            step = journey.step(state, turned, share, untangling=options.untangle)
            if step.why:
                motion, length = replace(motion, reason=step.why), length / 2.0
                continue
            turned = step.turned
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
    return replace(done, protection=protection, released=False)


def _rounded(found: Complex, places: Complex, free: Flags, *, single: bool) -> Floats:
    """(N, 2) as they will be kept; held nodes have their very places."""
    points = as_points(found)
    points[~free] = as_points(places[~free])
    return points.astype(np.float32).astype(np.float64) if single else points


def _place(z: complex, exponent: int) -> str:
    return " ".join(f"{value:.6g}" for value in np.ldexp([z.real, z.imag], exponent).tolist())

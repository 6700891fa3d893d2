"""The way of a boundary in steps: where nodes are after each, and what stands against it.

Each step begins from the mesh as it is, but layers and cells near refined walls always follow from the input, so that
they do not wear from step to step. A step that inverts cells is mended by untangling, with layers held as they were
carried, else with their nodes let go.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gmsnet.constraints.sliding import REASON, Sliding
from gmsnet.constraints.sliding_in_space import SurfaceSliding
from gmsnet.kernels.simplex.mean_ratio2 import EQUILATERAL, WEIGHTS
from gmsnet.kernels.simplex.mean_ratio3 import REGULAR
from gmsnet.kernels.star.guard import Precision
from gmsnet.kernels.whole.powers import shape_of_each
from gmsnet.measure.signs import exact_signs
from gmsnet.measure.volumes import look
from gmsnet.motion.path import Flags, Floats, Path
from gmsnet.motion.prescribed import Prescribed
from gmsnet.motion.rails import Rails, rails_of
from gmsnet.motion.rigid import Follower
from gmsnet.motion.rotations import Rotations
from gmsnet.parallel.executor import Executor
from gmsnet.parallel.memory import refuse_unless_free
from gmsnet.run.state import State
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume
from gmsnet.untangle.cells import first_rows, whole_cells
from gmsnet.untangle.result import HELD, Untangled

SUFFERED = 0.8  # of its 1/q in the input: a cell that has less is smoothed
SLIGHTLY = 0.98  # the same of cells that are worse than the worst one of the input
RINGS = 6  # around such cells
FARTHEST = 2.0**100  # from the origin, in units of the run: products of coordinates must not overflow
FARTHER = 100.0  # times as far from the origin as any node was or is to be: systems were solved without an exact digit
BYTES_PER_NODE, ALONG = {2: 2500, 3: 4700}, 2000  # of factors and edges, measured; and where nodes of a plane slide


@dataclass(frozen=True, eq=False)
class Step:
    """What came of a step. points: those of the state; attitude: of each node; why: what stood against it, "" if
    nothing. note: of untangling."""

    points: Floats
    attitude: Floats
    why: str = ""
    note: str = ""


class Journey:
    """What stays the same on the way.

    held: the topology in which nodes that are moved, and those that slide, stand still; base: that in which the latter
    are free; rails: what they slide on. dimension: of points. wrong: (T,) rows of cells that were not positive when the
    boundary began to move; shapes: (T,) 1/q then. movable: (T,) rows with a node that is smoothed. least: theirs.
    """

    slides: Flags | None
    held: Topology | Volume
    base: Topology | Volume
    rails: Rails | None
    dimension: int
    path: Path
    start: Floats
    follower: Follower
    wrong: Flags
    shapes: Floats
    movable: Flags
    least: float

    def __init__(self, state: State, prescribed: Prescribed) -> None:
        self.base = base = state.protection.base
        self.rails = rails_of(state.constraint, base.near_free)
        self.dimension = prescribed.dimension
        self.slides = state.sliding.nodes if isinstance(state.sliding, Sliding | SurfaceSliding) else None
        self.held = base if self.slides is None else base.holding(self.slides, REASON)
        self.precision = state.precision
        bytes_per_node = BYTES_PER_NODE[self.dimension] + ALONG * (self.dimension == 2 and self.rails is not None)
        refuse_unless_free(bytes_per_node * len(base.free), f"moving the nodes around {len(base.free):,}")
        self.start = self.places_of(state.points)
        still = self.held.near_free | ~base.near_free
        self.path = Path.of(prescribed, self.held, self.places_of(state.start), state.mesh.exponent, still)
        kept = np.zeros(len(self.start), dtype=bool)
        for nodes in (state.protection.layers, state.protection.near_walls):
            if nodes is not None:
                kept |= nodes[base.memory]
        moving = (self.path.end != self.path.start).any(axis=1)
        self.follower = Follower.of(base, self.start, moving, kept)
        self.wrong = self.inverted(state.points)
        self.shapes = self.shape(state.points)
        self.movable = np.asarray(state.protection.topology.near_free[self.held.near].any(axis=1))
        self.least = float(self.shapes[self.movable].min(initial=1.0))

    @property
    def rotations(self) -> Rotations:
        """Those of the dimension."""
        return self.path.rotations

    def places_of(self, points: Floats) -> Floats:
        """(N, D) of the points of a state."""
        return np.ascontiguousarray(points[:, : self.dimension])

    def inverted(self, points: Floats) -> Flags:
        """(T,) all rows of the cells that are not positive; of volumes, that may not be."""
        topology = self.held
        if isinstance(topology, Volume):
            return whole_cells(topology, looked_at(points, topology, self.precision)[0])
        return whole_cells(topology, exact_signs(points, topology.near, topology.near_orientation) <= 0)

    def shape(self, points: Floats) -> Floats:
        """(T,) 1/q of each corner simplex."""
        topology = self.held
        if isinstance(topology, Volume):
            return looked_at(points, topology, self.precision)[1]
        simplices = topology.simplices
        cells = np.where(topology.near_orientation[:, None] > 0, topology.near, topology.near[:, [0, 2, 1]])
        table = None if simplices.shapes is None else WEIGHTS[simplices.shapes]
        out = np.empty(len(cells))
        shape_of_each(points, np.ascontiguousarray(cells), table, out)
        return out

    def step(self, state: State, attitude: Floats, shares: tuple[float, float], executor: Executor | None) -> Step:
        """The mesh with the boundary at the second share of its way, after the first one.

        executor: of untangling; None where what is inverted is not to be mended.
        """
        places, turns = self.path.places(shares[1]), self.path.turns(shares[1])
        if why := self.crossing(state, places) or self.crushed(state, places):
            return Step(state.points, attitude, why)
        now, follower = self.places_of(state.points), self.follower
        a, b = follower.edges.T
        ways = self.rotations.back(follower.edges, now[b] - now[a], attitude)
        ways[follower.layers] = (self.start[b] - self.start[a])[follower.layers]
        since = turns - self.path.turns(shares[0]) if shares[0] else turns
        with np.errstate(over="ignore", invalid="ignore"):
            found, attitude = follower.follow(
                now, attitude, ways, places, turns, since, self.path.sure, self.rails
            )  # fmt: skip
        points = np.zeros_like(state.points)
        points[:, : self.dimension] = np.where(follower.free[:, None], state.precision.rounded(found), places)
        reach = FARTHER * max(float(np.abs(self.path.start).max()), float(np.abs(places).max()))
        if not (np.abs(points) < min(reach, FARTHEST)).all():
            return Step(state.points, attitude, "places would be too far away for their digits")
        if not (self.inverted(points) & ~self.wrong).any():
            return Step(points, attitude)
        if executor is None:
            return Step(points, attitude, "cells were inverted")
        return self.untangled(state, Step(points, attitude), executor)

    def untangled(self, state: State, step: Step, executor: Executor) -> Step:
        """The step with no cell inverted that was not at first, if that can be had."""
        protection, why = state.protection, ""
        levels = [protection.topology, protection.outer, protection.base]
        if self.slides is not None:
            levels = [topology.holding(self.slides, REASON) for topology in levels]
        for topology in dict.fromkeys(levels):
            done = self._untangled(step.points, topology, state, executor)
            rest = self.inverted(done.points) & ~self.wrong
            if not rest.any():
                steps = ", ".join(f"{each.name} ({each.sweeps})" for each in done.steps)
                let_go = "" if topology is levels[0] else "; nodes of layers or near walls were let go for that"
                note = f"untangling: all {done.before:,} inverted cells mended; {steps}{let_go}"
                return replace(step, points=done.points, note=note)
            why = self._why(state, topology, rest, done)
        return replace(step, why=why)

    def _untangled(self, points: Floats, topology: Topology | Volume, state: State, executor: Executor) -> Untangled:
        if isinstance(topology, Volume):
            from gmsnet.untangle.space import untangle_volume

            before = len(first_rows(topology, self.inverted(points)))
            return untangle_volume(points, topology, state.precision, executor, before)
        from gmsnet.untangle import untangle

        return untangle(points, topology, state.precision)

    def _why(self, state: State, topology: Topology | Volume, rest: Flags, done: Untangled) -> str:
        row = int(first_rows(topology, rest)[0])
        told = {each.row: each for each in done.unmended}.get(row)
        place, reason = self.places_of(done.points)[topology.near[row]].mean(axis=0), ""
        if told is not None:
            reason = f": {told.reason},"
            place = place if self.dimension == 3 else np.array(told.place)
        return f"{self._counted(topology, rest)}{reason} at {_place(place, state.mesh.exponent)}"

    def _counted(self, topology: Topology | Volume, wrong: Flags) -> str:
        rows = first_rows(topology, wrong)
        count = f"{len(rows):,} cells" if len(rows) > 1 else "1 cell"
        return f"{count} would be inverted, first cell {topology.cells_of(rows[:1])[0]}"

    def crossing(self, state: State, places: Floats) -> str:
        """Where boundaries cross, or lie on themselves, that did not at first, in words; "" if they do not, and for
        those of volumes, of which inverted cells tell."""
        if isinstance(self.held, Volume):
            return ""
        from gmsnet.untangle.crossings import crossings_of

        found = crossings_of(places, self.path.edges)
        if len(found) and not len(crossings_of(self.path.start, self.path.edges)):
            return f"boundaries would cross each other at {_place(found[0], state.mesh.exponent)}"
        found = self._doubled_back(self.held, places)
        return f"the boundary would lie on itself at {_place(found[0], state.mesh.exponent)}" if len(found) else ""

    def _doubled_back(self, topology: Topology, places: Floats) -> Floats:
        """(k, 2) where the boundary goes back along itself, with no angle left for the cells between.

        At the tip of a slit cells have all of the angle.
        """
        from gmsnet.untangle.crossings import angle_sums, doubled_back

        edges = self.path.edges
        back = np.setdiff1d(doubled_back(places, edges), doubled_back(self.path.start, edges))
        if not len(back):
            return places[back]
        shapes, rows = topology.near_shapes, topology.near
        rows = np.where(topology.near_orientation[:, None] > 0, rows, rows[:, [0, 2, 1]])
        whole = rows if shapes is None else rows[shapes == EQUILATERAL]  # of a quad each corner has a row of its own
        corners = np.concatenate([rows, whole[:, [1, 2, 0]], whole[:, [2, 0, 1]]])
        return places[back[angle_sums(places, *corners.T)[back] < np.pi]]

    def crushed(self, state: State, places: Floats) -> str:
        """Which cells would be inverted whose nodes are all held, in words; "" if none."""
        points = np.zeros_like(state.points)
        points[:, : self.dimension] = places
        topology = self.base
        loose = whole_cells(topology, np.asarray(topology.near_free[topology.near].any(axis=1)))
        wrong = ~loose & ~self.wrong
        if wrong.any():
            wrong &= self.inverted(points)
        if not wrong.any():
            return ""
        place = places[topology.near[first_rows(topology, wrong)[0]]].mean(axis=0)
        return f"{self._counted(topology, wrong)}: {HELD}, at {_place(place, state.mesh.exponent)}"

    def region(self, points: Floats) -> Flags:
        """(N,) by id: nodes of cells whose shapes have suffered, and those around."""
        topology, rows = self.held, self.held.near
        now = self.shape(points)
        worse = self.movable & (now < self.least) & (now < SLIGHTLY * self.shapes)
        bad = whole_cells(topology, worse | (now < SUFFERED * self.shapes))
        chosen = np.zeros(len(points), dtype=bool)
        chosen[rows[bad]] = True
        for _ in range(RINGS if bad.any() else 0):
            chosen[rows[chosen[rows].any(axis=1)]] = True
        by_id = np.empty_like(chosen)
        by_id[topology.memory] = chosen
        return by_id


def looked_at(points: Floats, topology: Volume, precision: Precision) -> tuple[Flags, Floats]:
    """(T,) which corner simplices of volumes belong to cells that may not be valid, and 1/q of each."""
    bad, inverted = np.empty((2, len(topology.near)), dtype=bool)
    ratio = np.empty(len(topology.near))
    look(points, topology.simplices, precision, bad, inverted, ratio)
    return bad, REGULAR * np.sign(ratio) * np.cbrt(ratio * ratio)


def _place(place: Floats, exponent: int) -> str:
    return " ".join(f"{value:.6g}" for value in np.ldexp(place, exponent).tolist())

"""The stages of a serial run that ranks have in common: sweeps; in space those for angles and the mean; near walls."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple, cast

import numpy as np

from gmsnet.constraints.sliding import Rails
from gmsnet.distributed.executor import Ranks
from gmsnet.distributed.mending import Mended
from gmsnet.distributed.part import Part
from gmsnet.measure.report import QualityReport, measure
from gmsnet.methods import Smoother
from gmsnet.methods.banded import Kept
from gmsnet.preserve.protection import Protection
from gmsnet.run.carry_out import carry_out_all
from gmsnet.run.options import SmoothOptions
from gmsnet.run.stages import SWEEPS
from gmsnet.run.state import State
from gmsnet.run.sweep_stage import sweep
from gmsnet.run.wall_stage import improve_near_walls, in_turns
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume


class _Input(NamedTuple):
    """As much of the input's QualityReport as these stages look at."""

    inverted: int


class Meant(NamedTuple):
    """The connectivity of a part, with the nodes held that are there on purpose.

    outer: those of layers alone. held: those near walls, too. walls: by id of the part, as of Protection.
    """

    outer: Topology | Volume
    held: Topology | Volume
    walls: Kept | None = None


def swept(
    part: Part, meant: Meant, smoother: Smoother, options: SmoothOptions, mended: Mended | None, inverted: int
) -> State:
    """The state after them, points in memory order. mended: where some cells were inverted; inverted: how many were.

    ``base`` of its protection has the nodes held that are held at the end.
    """
    executor, topology = _ready(part, meant.held)
    nothing, before = np.empty(0, dtype=np.float32), cast(QualityReport, _Input(inverted))
    if options.target and mended is None:  # it tells which cells miss the target
        before = replace(measure(part.mesh, part.topology, part.points), signs=None)
    state = State(
        part.mesh, lambda points: points, smoother, before, Protection(topology, []), part.points, part.points, nothing,
        sliding=None if part.rail is None else Rails(part.rail),
    )  # fmt: skip
    if mended is not None:
        state = replace(state, points=mended.points, untangled=mended.points)
    state, held = carry_out_all(state, options, executor, SWEEPS), state.protection
    if meant.walls is None or state.interruption is not None:
        return state
    released, topology = _ready(part, meant.outer)
    outer = Protection(topology, [], walls=meant.walls)

    def near(given: State) -> State:
        return carry_out_all(replace(given, protection=outer), options, released, [improve_near_walls])

    def elsewhere(given: State) -> State:
        return carry_out_all(replace(given, protection=held), options, executor, [sweep])

    last = in_turns(replace(state, protection=outer), near, elsewhere, options, released)
    return last if last.released else state


def _ready(part: Part, topology: Topology | Volume) -> tuple[Ranks, Topology | Volume]:
    found, numbers = part.ready(topology)
    return Ranks(part, numbers), found

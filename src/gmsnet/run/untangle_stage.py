"""Untangling as the first stages of smoothing: what was done in words, and which cells stay inverted and why."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.sliding import REASON, Sliding
from gmsnet.constraints.sliding_in_space import SurfaceSliding
from gmsnet.measure.report import QualityReport
from gmsnet.parallel.executor import Executor
from gmsnet.preserve.protection import protected, protected_volume
from gmsnet.run.options import SmoothOptions
from gmsnet.run.state import State
from gmsnet.topology.shell import Shell
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume

if TYPE_CHECKING:  # what untangling needs of SciPy takes 0.15 s more to import
    from gmsnet.untangle.result import Untangled

STILL = "; nodes that slide stand still while cells are untangled"

Reasons = Mapping[int, str]  # by the index of each cell among all cells of the mesh


class StillInvertedCell(NamedTuple):
    """A cell that is inverted still. cell: its index among all cells of the mesh."""

    cell: int
    reason: str


def untangle_all(state: State, options: SmoothOptions, executor: Executor) -> State:
    """Moves the free nodes so that fewer cells are inverted; those of second-order cells have a stage of their own."""
    if isinstance(state.topology, Shell) or (state.second_order is not None and not len(state.topology.free)):
        return state  # of surfaces, folded parts are mended (run/unfold.py), and sweeps turn what shows the other side
    if not options.untangle or not state.before.inverted:
        return state
    if state.second_order is None:
        return _untangled(state, executor, state.before.inverted)
    done, topology = _made(state, executor, None)  # of those that are invalid, curved ones are left to their own stage
    return _noted(state, done, topology) if done.before else state


def untangle_protected(state: State, options: SmoothOptions, executor: Executor) -> State:
    """Lets go of protected nodes beside cells that could not be untangled, and tries once more."""
    freed = None
    if state.reasons:
        freed = state.protection.released(beside(state.reasons, state.topology))
    if freed is None:
        return state
    protection, note = freed
    given = replace(state, protection=protection, untangling=(*state.untangling, note))
    return _untangled(given, executor, state.before.inverted)


def untangle_left(state: State, executor: Executor) -> State | None:
    """Tries once more to mend what was left, from where sweeps have taken the nodes; None where no more is mended."""
    done, topology = _made(state, executor, None)
    return _noted(state, done, topology) if done.after < done.before else None


def protect_untangled(state: State, options: SmoothOptions, executor: Executor) -> State:
    """Protects what is there on purpose in the mesh as it is once it is untangled: tangles are no layers."""
    mesh, base = state.mesh, state.protection.base
    if isinstance(base, Volume):
        if not state.before.inverted:
            return state
        firm = bool(state.reasons)
        found = protected_volume(base, options.preserved, options.fix_layers, state.points, firm=firm)
        return replace(state, protection=found, untangled=state.points)
    if not state.untangling or isinstance(base, Shell):
        return state
    points = mesh.points.copy()
    points[base.memory[:, None], list(mesh.plane or ())] = np.ldexp(state.points, mesh.exponent)
    found = protected(
        mesh.with_points(points), base, options.preserved, options.fix_layers, state.points,
        firm=bool(options.target or state.reasons),
    )  # fmt: skip
    return replace(state, protection=found, untangled=state.points)


def _untangled(state: State, executor: Executor, before: int) -> State:
    return _noted(state, *_made(state, executor, before))


def _made(state: State, executor: Executor, before: int | None) -> tuple[Untangled, Topology | Volume]:
    """What untangling makes of the points, and of which topology. before: as of ``untangle_volume``."""
    topology = state.topology
    if isinstance(state.sliding, Sliding | SurfaceSliding):
        topology = topology.holding(state.sliding.nodes, REASON)
    if isinstance(topology, Volume):
        from gmsnet.untangle.space import untangle_volume

        done = untangle_volume(state.points, topology, state.precision, executor, before)
    else:
        from gmsnet.untangle import untangle  # what it needs of SciPy takes 0.15 s more to import

        done = untangle(state.points, topology, state.precision)
    return done, topology


def _noted(state: State, done: Untangled, topology: Topology | Volume) -> State:
    """The state with what untangling has made, and what there is to say about it."""
    cells = topology.cells_of(np.array([cell.row for cell in done.unmended], dtype=np.intp)).tolist()
    reasons = {index: cell.reason for index, cell in zip(cells, done.unmended, strict=True)}
    note = note_of(done) + (STILL if done.after and len(topology.held.get(REASON, ())) else "")
    return replace(state, points=done.points, totals=None, untangling=(*state.untangling, note), reasons=reasons)


def note_of(done: Untangled) -> str:
    """What to say of it."""
    steps = ", ".join(f"{step.name} ({step.sweeps})" for step in done.steps) or "nothing to try"
    left = f"{done.after:,} of {done.before:,} inverted cells are left" if done.after else f"all {done.before:,} mended"
    return f"untangling: {left}; {steps}{f'; {done.why}' if done.why else ''}"


def beside(reasons: Reasons, topology: Topology | Volume) -> NDArray[np.bool_]:
    """(N,) bool by id: the nodes of the cells that have a reason, and their neighbours."""
    chosen = np.zeros(len(topology.memory), dtype=bool)
    cells = np.array(list(reasons), dtype=np.int64)
    if isinstance(topology, Volume):
        kinds = [(topology.cells, topology.cell)]
    else:
        kinds = [(topology.triangles, topology.cell), (topology.quads, topology.quad_cell)]
    for corners, index in kinds:
        chosen[corners[np.isin(index, cells)]] = True
    around = chosen.copy()
    for corners, _ in kinds:
        around[corners[chosen[corners].any(axis=1)]] = True
    return around


def still_inverted(after: QualityReport, reasons: Reasons) -> list[StillInvertedCell]:
    """The cells with a corner of zero or negative area that have a reason for it."""
    cells = after.cell[~after.valid].tolist() if reasons else []
    return [StillInvertedCell(cell, reasons[cell]) for cell in cells if cell in reasons]

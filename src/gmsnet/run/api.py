"""smooth() and quality(): what users call."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import InputError
from gmsnet.kernels.topology.connectivity import CHOSEN
from gmsnet.measure.report import QualityReport, measure
from gmsnet.measure.target import Target
from gmsnet.measure.totals import Totals
from gmsnet.mesh.adapters import to_mesh
from gmsnet.mesh.mesh import Mesh, unknown_cells, unmeasured
from gmsnet.mesh.selection import fixed_mask
from gmsnet.methods import Smoother, StarSmoother, smoother
from gmsnet.methods.auto import Auto
from gmsnet.parallel.memory import refuse_unless_free
from gmsnet.parallel.threads import available_threads, side_by_side
from gmsnet.preserve.protection import WALL, Protection, method_for, protected, wall_note
from gmsnet.run.options import check_arguments
from gmsnet.run.result import SmoothResult
from gmsnet.run.run import Run, outcome, precision_of, rank_by
from gmsnet.run.score import Score
from gmsnet.run.stop import INTERRUPTED, NO_PROGRESS, NOTHING_TO_MOVE
from gmsnet.run.sweep import Sweep
from gmsnet.run.target_run import reach_target
from gmsnet.run.untangle_stage import beside, mended, still_inverted
from gmsnet.run.wall_stage import improve_near_walls
from gmsnet.topology.held import REASONS
from gmsnet.topology.topology import Topology

Floats = NDArray[np.float64]

MANY = 20_000  # nodes: for the set-up of fewer a second thread is not worth starting
BYTES_PER_NODE = 400  # that a call takes at most on a mesh of triangles, copies of them included; ``auto`` takes 250


def smooth(
    mesh: Any,
    method: str = "auto",
    *,
    variant: str | None = None,
    objective: str | None = None,
    max_sweeps: int = 100,
    threads: int | None = None,
    target_quality: float | None = None,
    target_angle: float | None = None,
    fixed: Any = None,
    preserve: str = "shape",
    fix_layers: bool = False,
    untangle: bool = True,
    guard: str = "worst",
    seed: int = 0,
    callback: Callable[[Sweep], bool | None] | None = None,
    weights: str | os.PathLike[str] | None = None,
    best_by: str = "shape",
) -> SmoothResult:
    """Moves the free nodes of a planar triangle mesh so that its elements become better; changes nothing else.

    No cell that is valid becomes invalid, the worst cell does not get worse (``guard``), and of all meshes on the way
    the best is returned: the one with the fewest inverted cells, then with the largest q̂ (for a target: with the fewest
    cells that miss it), the input among them.

    mesh: (points, cells) arrays, a Mesh, or a meshio, meshlane or PyVista object; it is not changed. method: a name
    in METHODS. variant, objective: names out of the method's own lists (default: their first). max_sweeps: at most
    so many sweeps; in most, each node is visited once, in those of ``worst-first`` some nodes are often. threads:
    at most so many (default: the processors at hand); the result is the same bits for any number. target_quality,
    target_angle: the minimum 1/q, in (0, 1], and the minimum angle, in (0, 60] degrees, that every cell is to have:
    only cells that miss it and what is around them are smoothed, until none misses it. fixed: nodes to hold besides
    boundary, interfaces and the like: ids, a mask, a marker's name or a list of names. preserve: "shape" holds the
    nodes of layers that are stretched on purpose, "size" besides keeps the areas of cells, "none" neither.
    fix_layers: hold stretched layers whatever ``preserve`` says. untangle: mend inverted cells first, where there
    are any. guard: what each sweep keeps besides validity: "valid" nothing (as the paper), "worst" that the worst
    1/q of the cells with a free node never falls, "star" that the worst 1/q around any free node never falls. seed:
    for methods that draw random numbers (none does so far). callback: called after each look at the mesh, with most
    methods after each sweep; a true answer stops the run. weights: a safetensors file for methods with weights.
    best_by: which 1/q enters the q̂ that says which mesh is the best: "shape" (1/q) or "aspect" (1/q_V, with which
    the paper's tables are formed).

    Raises InputError for what cannot be used, and where memory does not suffice, before anything is moved.
    """
    began = time.perf_counter()
    create = check_options(
        method, variant=variant, objective=objective, max_sweeps=max_sweeps, threads=threads,
        target_quality=target_quality, target_angle=target_angle, preserve=preserve, fix_layers=fix_layers,
        untangle=untangle, guard=guard, seed=seed, callback=callback, weights=weights, best_by=best_by,
    )  # fmt: skip
    target, chosen = Target(target_quality, target_angle), create()
    given, restore = to_mesh(mesh)
    check_mesh(given, target)
    others, unknown = unmeasured(given) if target else "", unknown_cells(given)
    refuse_unless_free(BYTES_PER_NODE * len(given.points), f"smoothing {len(given.points):,} nodes")
    threads = threads or available_threads()
    apart = threads if len(given.points) >= MANY else 1
    asked = fixed_mask(given, fixed)
    topology, start = Topology.and_points(given, asked, apart)
    given = given.without_cells()  # whatever was copied of them is given back

    shapes = np.empty(len(topology.near) if target else 0, dtype=np.float32)

    def looked_at(near: Floats) -> tuple[QualityReport, Protection]:
        return measure(given, topology, near, shapes=shapes), protected(given, topology, preserve, fix_layers, near)

    if apart == 1 or target or not isinstance(chosen, Auto | StarSmoother):
        before, protection = looked_at(start)
    else:  # most often nothing is protected, and these are the stars that are smoothed
        (before, protection), _ = side_by_side(apart, partial(looked_at, start), lambda: topology.stars)
    given_points = start
    reasons: dict[int, str] = {}
    untangling: list[str] = []
    if untangle and before.inverted:
        start, note, reasons = mended(start, protection.topology, precision_of(given))
        freed = protection.released(beside(reasons, protection.topology)) if reasons else None
        if freed is not None:
            protection, first = freed, note
            start, note, reasons = mended(start, protection.topology, precision_of(given))
            untangling.append(first)
        untangling.append(note)
    topology, notes = protection.topology, [*protection.notes, *untangling]
    if asked.any() and REASONS[CHOSEN] not in topology.held:
        count = np.count_nonzero(asked)
        named = "1 node is" if count == 1 else f"{count:,} nodes are"
        notes.append(f"fixed: {named} named, and held for other reasons anyway")
    if unknown:
        notes.append(f"the nodes of {unknown} are held: gmsnet does not know this type of cells")
    if others:
        notes.append(f"the target is asked of triangles alone, not of {others}")

    options: dict[str, Any] = {"threads": threads, "best_by": best_by, "guard": guard}
    totals = None  # of the best points, where they are known
    if target:
        best, stop_reason, history = reach_target(
            given, topology, None if isinstance(chosen, Auto) else create, target, start,
            max_sweeps=max_sweeps, callback=callback, report=None if before.inverted else before,
            shapes=shapes if start is given_points else None, **options,
        )  # fmt: skip
    else:
        score = Score.of(before.totals, best_by) if start is given_points else None
        best, stop_reason, history, totals = _smoothed(
            Run(given, topology, chosen, points=start, score=score, **options), max_sweeps, callback
        )
        if protection.kept is not None and stop_reason in (NO_PROGRESS, NOTHING_TO_MOVE):
            topology, totals = protection.outer, None
            try:
                best, stop_reason, history = improve_near_walls(
                    given, topology, protection.kept, best, history, max_sweeps=max_sweeps, callback=callback,
                    **options,
                )  # fmt: skip
            except KeyboardInterrupt:  # what was made before it is kept
                stop_reason = INTERRUPTED

    if protection.kept is not None:
        near_wall = len(protection.topology.held.get(WALL, ()))
        notes.insert(len(protection.notes), wall_note(near_wall, moved=topology is protection.outer))

    rank = target.rank if target else rank_by(best_by)
    try:
        points, moved, after = outcome(given, topology, best, before, rank, given_points, threads, totals)
    except KeyboardInterrupt:  # nothing is lost by finishing what takes less than a sweep
        stop_reason = INTERRUPTED
        points, moved, after = outcome(given, topology, best, before, rank, given_points, threads, totals)
    del start, given_points, best  # before the copies for the result are made
    return SmoothResult(
        mesh=restore(points),
        points=points.copy(),
        before=before,
        after=after,
        sweeps=history[-1].index if history else 0,
        stop_reason=stop_reason,
        moved=moved,
        held=topology.held,
        history=history,
        notes=notes,
        unmended=still_inverted(after, reasons),
        topology=topology,
        seconds=time.perf_counter() - began,
    )


def _smoothed(
    run: Run, max_sweeps: int, callback: Callable[[Sweep], bool | None] | None
) -> tuple[Floats, str, list[Sweep], Totals | None]:
    """The best points of a whole run, why it ended, its record, and the totals of the best; nothing else is kept."""
    stop_reason = run.to_the_end(max_sweeps, callback)
    return run.best, stop_reason, run.history, run.best_score.totals


def check_options(
    method: str, *, variant: Any = None, objective: Any = None, weights: Any = None, seed: Any = 0,
    preserve: Any, target_quality: Any, target_angle: Any, callback: Any = None, **others: Any,
) -> Callable[[], Smoother]:  # fmt: skip
    """What makes the smoother that the options of ``smooth`` name; InputError for the first that cannot be used."""
    check_arguments(
        preserve=preserve, target_quality=target_quality, target_angle=target_angle, callback=callback,
        weights=weights, seed=seed, **others,
    )  # fmt: skip
    name = method_for(method, variant, preserve, Target(target_quality, target_angle))
    return lambda: smoother(name, variant=variant, objective=objective, weights=weights, seed=seed)


def quality(mesh: Any) -> QualityReport:
    """The measures of a mesh's triangles: (points, cells) arrays, a Mesh, or a meshio, meshlane or PyVista object."""
    return measure(to_mesh(mesh)[0])


def check_mesh(mesh: Mesh, target: Target) -> None:
    """InputError for volume meshes and curved surfaces, which cannot be smoothed yet, and targets of no triangle."""
    others = unmeasured(mesh) if target else ""
    if others and not any(len(block.nodes) for block in mesh.cells if block.triangular):
        raise InputError(f"a target is asked of triangles, and this mesh has none: {others} cannot be measured so far")
    volumes = sorted({block.kind for block in mesh.cells if block.dimension == 3 and len(block.nodes)})
    if mesh.plane is None and volumes:
        raise InputError(
            f"this is a volume mesh ({', '.join(volumes)}): only planar triangle meshes can be smoothed so far"
        )
    if mesh.plane is None and (unknown := unknown_cells(mesh)):
        raise InputError(
            f"the mesh varies in x, y and z and has cells of a type that gmsnet does not know ({unknown}): "
            "only planar triangle meshes can be smoothed so far"
        )
    if mesh.plane is None:
        extent = np.ptp(mesh.points, axis=0)
        raise InputError(
            "this is a curved surface (x, y and z all vary, by "
            + ", ".join(f"{e:.3g}" for e in extent)
            + "): only meshes in a plane of constant x, y or z can be smoothed so far"
        )

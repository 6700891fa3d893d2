"""smooth(): sweeps over the stars by colour, stop rules, and of all meshes on the way the best."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.adapters import to_mesh
from gmsnet.errors import InputError
from gmsnet.fixed import fixed_mask
from gmsnet.kernels import quality as kernels
from gmsnet.kernels.compile import LANES
from gmsnet.measure import QualityReport, measure, weighted_metric
from gmsnet.mesh import Mesh
from gmsnet.methods import Options, Precision, Smoother, method_named
from gmsnet.topology import Topology, planar_points, scale_exponent

Floats = NDArray[np.float64]

MAX_SWEEPS = "max sweeps"
NO_PROGRESS = "no progress"
TARGET_REACHED = "target reached"
CALLBACK = "stopped by callback"
INTERRUPTED = "interrupted"
NOTHING_TO_MOVE = "nothing to move"

PATIENCE = 10  # sweeps within which q̂ must rise by LEAST_GAIN, or a cell be mended, for the run to go on
LEAST_GAIN = 1e-4
ROUNDING = 1e-12  # a smaller gain in q̂ is no gain
BLOCKS_PER_THREAD = 32  # fewer do not pay for handing them to a thread


@dataclass(frozen=True)
class Sweep:
    """What one sweep did, and the mesh after it. index counts from 1; moved, truncated, dropped count nodes."""

    index: int
    moved: int
    truncated: int
    dropped: int
    inverted: int
    qhat: float
    min_shape: float
    mean_shape: float


@dataclass(frozen=True, eq=False)
class SmoothResult:
    """What ``smooth`` returns.

    mesh: of the type that came in. points: (N, dim) float64. before, after: QualityReports. sweeps: how many were
    made. stop_reason: one of the texts above. moved: (N,) bool, which nodes are elsewhere than in the input.
    held: reason → ids of the nodes that were not free. history: one Sweep each. seconds: for the whole call.
    """

    mesh: Any
    points: Floats
    before: QualityReport
    after: QualityReport
    sweeps: int
    stop_reason: str
    moved: NDArray[np.bool_]
    held: dict[str, NDArray[np.int64]]
    history: list[Sweep]
    seconds: float


def smooth(
    mesh: Any,
    method: str = "gmsnet",
    *,
    max_sweeps: int = 100,
    threads: int | None = None,
    target_quality: float | None = None,
    fixed: Any = None,
    seed: int = 0,
    callback: Callable[[Sweep], bool | None] | None = None,
    weights: str | Path | None = None,
) -> SmoothResult:
    """Moves the free nodes of a planar triangle mesh so that its elements become better; changes nothing else.

    No cell that is valid becomes invalid, and of all meshes on the way the best is returned: the one with the fewest
    inverted cells, then with the largest q̂, the input among them.

    mesh: (points, cells) arrays, a Mesh, or a meshio, meshlane or PyVista object; it is not changed. method: a name in
    METHODS. max_sweeps: at most so many visits of each node. threads: at most so many (default: the processors at
    hand); the result is the same bits for any number. target_quality: stop once the least 1/q of a cell is at least
    this, in (0, 1]. fixed: nodes to hold besides boundary, interfaces and the like: ids, a mask, a marker's name or a
    list of names. seed: for methods that draw random numbers (GMSNet does not). callback: called after each sweep; a
    true answer stops the run. weights: a safetensors file for methods with weights.

    Raises InputError for what cannot be used, before anything is moved.
    """
    began = time.perf_counter()
    _check(max_sweeps, threads, target_quality)
    smoother = method_named(method).create(Options(weights=weights, seed=seed))
    held_mesh, restore = to_mesh(mesh)
    refuse_unless_planar(held_mesh)
    topology = Topology.of(held_mesh, fixed_mask(held_mesh, fixed))
    before = measure(held_mesh, topology)
    run = _Run(held_mesh, topology, smoother, threads or available_threads())
    stop_reason = run.to_the_end(max_sweeps, target_quality, callback)

    try:
        points, moved, after = run.outcome(before)
    except KeyboardInterrupt:  # nothing is lost by finishing what takes less than a sweep
        stop_reason = INTERRUPTED
        points, moved, after = run.outcome(before)
    return SmoothResult(
        mesh=restore(points),
        points=points.copy(),
        before=before,
        after=after,
        sweeps=len(run.history),
        stop_reason=stop_reason,
        moved=moved,
        held=topology.held,
        history=run.history,
        seconds=time.perf_counter() - began,
    )


def quality(mesh: Any) -> QualityReport:
    """The measures of a mesh's triangles: (points, cells) arrays, a Mesh, or a meshio, meshlane or PyVista object."""
    return measure(to_mesh(mesh)[0])


def available_threads() -> int:
    """The processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def refuse_unless_planar(mesh: Mesh) -> None:
    """InputError for volume meshes and curved surfaces, which cannot be smoothed yet."""
    volumes = sorted({block.kind for block in mesh.cells if block.dimension == 3 and len(block.nodes)})
    if mesh.plane is None and volumes:
        raise InputError(
            f"this is a volume mesh ({', '.join(volumes)}): only planar triangle meshes can be smoothed so far"
        )
    if mesh.plane is None:
        extent = np.ptp(mesh.points, axis=0)
        raise InputError(
            "this is a curved surface (x, y and z all vary, by "
            + ", ".join(f"{e:.3g}" for e in extent)
            + "): only meshes in a plane of constant x, y or z can be smoothed so far"
        )


def _check(max_sweeps: int, threads: int | None, target_quality: float | None) -> None:
    if isinstance(max_sweeps, bool) or not isinstance(max_sweeps, (int, np.integer)) or max_sweeps < 0:
        raise InputError(f"max_sweeps must be a whole number of 0 or more, got {max_sweeps!r}")
    if threads is not None and (isinstance(threads, bool) or not isinstance(threads, (int, np.integer)) or threads < 1):
        raise InputError(f"threads must be a whole number of 1 or more, got {threads!r}")
    if target_quality is not None and not 0.0 < target_quality <= 1.0:
        raise InputError(f"target_quality is the least 1/q of a cell and must lie in (0, 1], got {target_quality!r}")


class _Run:
    """The state of one run: coordinates in memory order, the best so far, and the record."""

    def __init__(self, mesh: Mesh, topology: Topology, smoother: Smoother, threads: int) -> None:
        self.mesh, self.topology, self.smoother = mesh, topology, smoother
        self.precision = Precision.of(single=mesh.single, exponent=scale_exponent(mesh))
        self.start = planar_points(mesh)[topology.memory]
        self.points = self.start.copy()
        self.triangles = topology.near
        self.threads = threads
        self.history: list[Sweep] = []
        self.sums = np.empty((-(-len(self.triangles) // LANES), 7))
        self.best, self.best_standing = self.start, self._standing()

    def to_the_end(self, max_sweeps: int, target: float | None, callback: Callable[[Sweep], bool | None] | None) -> str:
        """Sweeps until a stop rule says why to stop."""
        if not len(self.topology.free):
            return NOTHING_TO_MOVE
        if target is not None and self.best_standing.min_shape >= target:
            return TARGET_REACHED
        try:
            with _workers(self.threads, len(self.topology.stars.count)) as share:
                while len(self.history) < max_sweeps:
                    sweep = self._sweep(share)
                    if callback is not None and callback(sweep):
                        return CALLBACK
                    if target is not None and self.best_standing.min_shape >= target:
                        return TARGET_REACHED
                    if sweep.moved == 0 or self._stalled():
                        return NO_PROGRESS
        except KeyboardInterrupt:  # the best mesh so far is whole: it is a copy
            return INTERRUPTED
        return MAX_SWEEPS

    def best_points(self) -> tuple[Floats, NDArray[np.bool_]]:
        """The best coordinates (N, dim) and which nodes they move. All others keep their very bits."""
        elsewhere = (self.best != self.start).any(axis=1)
        ids = self.topology.memory[elsewhere]
        points = self.mesh.points.copy()
        plane = self.mesh.plane
        assert plane is not None
        points[np.ix_(ids, plane)] = np.ldexp(self.best[elsewhere], scale_exponent(self.mesh))
        moved = np.zeros(len(points), dtype=bool)
        moved[ids] = True
        return points, moved

    def outcome(self, before: QualityReport) -> tuple[Floats, NDArray[np.bool_], QualityReport]:
        """Points, which of them moved, and their measures; those of the input if the quick sums misjudged it."""
        points, moved = self.best_points()
        if moved.any():
            after = measure(self.mesh.with_points(points), self.topology)
            if (after.inverted, -after.qhat) <= (before.inverted, -before.qhat):
                return points, moved, after
        return self.mesh.points, np.zeros(len(points), dtype=bool), before

    def _sweep(self, share: _Share) -> Sweep:
        stars, tally = self.topology.stars, np.zeros(3, dtype=np.int64)
        for colour in range(stars.colours):

            def visit(first: int, last: int) -> NDArray[np.int64]:
                counts = np.zeros(3, dtype=np.int64)
                self.smoother.sweep(self.points, stars, first, last, self.precision, counts)
                return counts

            tally += sum(share(visit, int(stars.first[colour]), int(stars.first[colour + 1])))
        standing = self._standing(share)
        moved, truncated, dropped = tally.tolist()
        sweep = Sweep(
            len(self.history) + 1, moved, truncated, dropped, standing.inverted, standing.qhat, standing.min_shape,
            standing.mean_shape,
        )  # fmt: skip
        self.history.append(sweep)
        if standing.beats(self.best_standing):
            self.best, self.best_standing = self.points.copy(), standing
        return sweep

    def _standing(self, share: _Share | None = None) -> _Standing:
        """The sums over all triangles of the coordinates as they are."""
        turn = self.topology.near_turn

        def add(first: int, last: int) -> None:
            kernels.summarise(self.points, self.triangles, turn, first, last, self.sums)

        if share is None:
            add(0, len(self.sums))
        else:
            share(add, 0, len(self.sums))
        return _Standing.of(self.sums, len(self.triangles))

    def _stalled(self) -> bool:
        """Has nothing been gained for PATIENCE sweeps?"""
        if len(self.history) <= PATIENCE:
            return False
        earlier, recent = self.history[:-PATIENCE], self.history[-PATIENCE:]
        fewest = min(s.inverted for s in earlier)
        if min(s.inverted for s in recent) < fewest:
            return False
        best = max(s.qhat for s in earlier if s.inverted == fewest)
        return max((s.qhat for s in recent if s.inverted == fewest), default=-math.inf) < best + LEAST_GAIN


@dataclass(frozen=True)
class _Standing:
    """Where a mesh stands in the comparison of meshes on the way."""

    inverted: int
    qhat: float
    min_shape: float
    mean_shape: float

    @classmethod
    def of(cls, sums: Floats, triangles: int) -> _Standing:
        if triangles == 0:
            return cls(0, math.nan, math.inf, math.nan)
        low, high, shape = (float(sums[:, k].sum()) / triangles for k in range(3))
        worst_low, worst_high = float(sums[:, kernels.MIN_LOW].min()), float(sums[:, kernels.MAX_HIGH].max())
        worst_shape = float(sums[:, kernels.MIN_SHAPE].min())
        low, worst_low, worst_high, high = map(math.degrees, (low, worst_low, worst_high, high))
        qhat = weighted_metric(low, worst_low, worst_high, high, shape, worst_shape)
        return cls(int(sums[:, kernels.INVERTED].sum()), qhat, worst_shape, shape)

    def beats(self, other: _Standing) -> bool:
        if self.inverted != other.inverted:
            return self.inverted < other.inverted
        return self.qhat > other.qhat + ROUNDING


_Share = Callable[[Callable[[int, int], Any], int, int], list[Any]]


@contextmanager
def _workers(threads: int, blocks: int) -> Iterator[_Share]:
    """Gives a function that calls another on ranges first…last, in ``threads`` pieces side by side where that pays."""
    if threads == 1 or blocks < 2 * BLOCKS_PER_THREAD:
        yield lambda work, first, last: [work(first, last)]
        return
    with ThreadPoolExecutor(threads) as pool:

        def share(work: Callable[[int, int], Any], first: int, last: int) -> list[Any]:
            pieces = max(1, min(threads, (last - first) // BLOCKS_PER_THREAD))
            ends = [first + (last - first) * k // pieces for k in range(pieces + 1)]
            return list(pool.map(work, ends[:-1], ends[1:]))

        yield share

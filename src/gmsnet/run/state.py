"""A mesh on its way through the stages of ``smooth``."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.sliding import Rails, Sliding
from gmsnet.constraints.sliding_in_space import SurfaceSliding
from gmsnet.kernels.curved.stars3 import CurvedSolids
from gmsnet.kernels.simplex.bernstein import CORNERS, NAMES
from gmsnet.kernels.star.constraint import Constraint
from gmsnet.kernels.star.guard import Precision
from gmsnet.kernels.star.surface import Surface
from gmsnet.measure.judged import Judged
from gmsnet.measure.report import QualityReport
from gmsnet.measure.totals import Totals
from gmsnet.mesh.mesh import Mesh
from gmsnet.methods import Smoother
from gmsnet.methods.curved import Curved
from gmsnet.metric.conformity import Conformity
from gmsnet.metric.field import Metric
from gmsnet.preserve.protection import Protection
from gmsnet.run.run import Start, precision_of
from gmsnet.run.score import Score
from gmsnet.run.stop import CALLBACK, INTERRUPTED
from gmsnet.run.sweep import Sweep
from gmsnet.topology.curved_solids import CORNERS3, CURVED
from gmsnet.topology.held import OF_SECOND_ORDER
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume

Floats = NDArray[np.float64]


class Final(NamedTuple):
    """What is left of a mesh after the stages. points: (N, dim) by id. moved: (N,) bool. after: the measures. judged:
    those by which it was compared with the input."""

    points: Floats
    moved: NDArray[np.bool_]
    after: QualityReport
    judged: Judged


@dataclass(frozen=True, eq=False)
class SecondOrder:
    """The second-order cells of a mesh (run/second_order.py).

    cells: (C, 9) ids, counter-clockwise, −1 past the last node; kinds: (C,) (kernels.simplex.bernstein), first-order
    cells of the mesh among them. Of volumes (C, 27) of positive sense, and numbers of topology.curved_solids.CURVED.
    free: (N,) bool by ids. whole: the connectivity of the mesh with straight cells, where corners are free, too;
    protection: of that, and what of it is protected. sign: (C,) of det J in each cell, as it is now. invalid: how many
    second-order cells are not certified valid, least: the least certified bound over a straight cell's size, of volumes
    over its least determinant at a corner, both at first and now. quality: (C,) these bounds now, sharp where they are
    low. linked: volumes and what follows their corners, by places in memory. None is known before the first stage.
    unable: why the method does not move corners. numbers: (C,) of each cell among all of the mesh. reasons: why cells,
    by these, could not be made valid. stopped: some corners may not have gone where the method put them. room: no bound
    of a valid cell falls below it while corners move; −∞ before that is known. in_vain: what is left invalid was tried
    once more after that. outer: the ids of nodes on facets of one
    cell alone, of a mesh that has volumes of the second order alone; between: of those between regions of such cells.
    """

    cells: NDArray[np.int32]
    kinds: NDArray[np.int8]
    free: NDArray[np.bool_]
    whole: Topology | Volume
    protection: Protection
    numbers: NDArray[np.int64]
    sign: NDArray[np.int8] | None = None
    quality: Floats | None = None
    linked: CurvedSolids | None = None
    invalid: tuple[int, int] = (0, 0)
    least: tuple[float, float] = (0.0, 0.0)
    unable: str = ""
    reasons: Mapping[int, str] = field(default_factory=dict)
    stopped: bool = False
    room: float = -math.inf
    in_vain: bool = False
    outer: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    between: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, dtype=np.int64))

    @property
    def solid(self) -> bool:
        """Are they volumes?"""
        return isinstance(self.whole, Volume)

    @property
    def curved(self) -> NDArray[np.bool_]:
        """(C,) which cells are of the second order."""
        return np.asarray(self.kinds < (len(CURVED) if self.solid else len(NAMES)))

    @property
    def tetrahedra(self) -> NDArray[np.bool_]:
        """(C,) which cells are tetrahedra of the second order."""
        return np.asarray(self.solid & (self.kinds == CURVED.index("tetra10")))

    @property
    def corners(self) -> NDArray[np.bool_]:
        """(N,) by id: which nodes are a corner."""
        found = np.zeros(len(self.free), dtype=bool)
        for kind, count in enumerate(CORNERS3 if self.solid else CORNERS):
            found[self.cells[self.kinds == kind, :count]] = True
        return found

    def figures(self, sign: NDArray[np.int8], quality: Floats) -> tuple[int, float]:
        """How many second-order cells are not certified valid, and the least of their bounds."""
        return int((sign != 1)[self.curved].sum()), float(quality[self.curved].min())

    def note(self, moved: NDArray[np.bool_]) -> str:
        """What was done. moved: (N,) by id."""
        before, after = (f"{count:,} invalid cell{'' if count == 1 else 's'}" for count in self.invalid)
        least = self.least if moved.any() else self.least[:1] * 2
        corners, free = self.corners, self.free | moved  # nodes that slide move, too
        return (
            f"second order: {before} before, {after} after; the least bound of a determinant over that of the straight "
            f"cell {_bound(least[0])} before, {_bound(least[1])} after; {(moved & corners).sum():,} of "
            f"{(free & corners).sum():,} free corners and {(moved & free & ~corners).sum():,} of "
            f"{(free & ~corners).sum():,} free middle nodes moved{self.unable}"
        )


def _bound(value: float) -> str:
    return f"{value:.3g}" if math.isfinite(value) else "unknown, for one is inverted,"


@dataclass(frozen=True)
class Motion:
    """How far a boundary has moved. fraction: of its way; steps: in so many; reason: why not further, "" if all."""

    fraction: float = 0.0
    steps: int = 0
    reason: str = ""


@dataclass(frozen=True, eq=False)
class State:
    """Each stage makes a new one. Nothing in it is changed in place.

    mesh: the input, without its cells. restore: what makes a mesh of the type that came in of points (N, dim).
    smoother: the method, ready for one run. before: the measures of the input. protection: what of it is protected.
    start: (N, 2) the nodes of the input, points: those of the best mesh so far, both in memory order (``near_points``).
    shapes: (T,) 1/q of the input's triangles in ``topology.near``; none without a target. remarks: what there is to say
    about the input. totals: of the points and the scored cells of the topology, where they are known; first: of the
    input and those of a topology. untangling: what was done about inverted cells,
    untangled: the points after that, in which ``protection`` was found, None where nothing was done. reasons: why
    some are left, by the index of each cell. history: one Sweep for each look. stop_reason: one of ``run.stop``,
    "" before the first sweep. released: the nodes near walls are no longer held (``wall_stage``).
    sliding: the nodes that move along curves or a boundary, if any. curved: while the corners of second-order cells
    move, those cells (``second_order``, which is all that is known of them). nodal: (N, 3) by id, the logarithms of a
    metric that is given at nodes. metric: what cells are to become, once it is known; conformity: of the input to it,
    and of the result. interruption: what ends the smoothing before its end. final:
    once the mesh is written back to the order of the input; start, points and shapes are then empty, lest the result
    needs more memory than the stages. motion: of a boundary that moves (``deform_stage``). rest: of a volume, with the
    nodes of cells held behind which others could become better (``rest_stage``). floor: what the guard kept of the
    worst cell of the points ``floor_of``, where that is known (methods/floor.py).
    """

    mesh: Mesh
    restore: Callable[[Floats], Any]
    smoother: Smoother
    before: QualityReport
    protection: Protection
    start: Floats
    points: Floats
    shapes: NDArray[np.float32]
    remarks: tuple[str, ...] = ()
    totals: Totals | None = None
    first: tuple[Topology | Volume, Totals] | None = None
    untangling: tuple[str, ...] = ()
    untangled: Floats | None = None
    reasons: Mapping[int, str] = field(default_factory=dict)
    history: tuple[Sweep, ...] = ()
    stop_reason: str = ""
    released: bool = False
    interruption: KeyboardInterrupt | None = None
    final: Final | None = None
    sliding: Sliding | SurfaceSliding | Rails | None = None
    second_order: SecondOrder | None = None
    curved: Curved | None = None
    motion: Motion | None = None
    nodal: Floats | None = None
    metric: Metric | None = None
    conformity: tuple[Conformity, ...] = ()
    rest: Volume | None = None
    floor: float | None = None
    floor_of: Floats | None = None

    @property
    def topology(self) -> Topology | Volume:
        """With the nodes that are held now."""
        return self.protection.outer if self.released else self.protection.topology

    @property
    def planar(self) -> Topology:
        """The same of a mesh in a plane, for stages that know no other."""
        assert isinstance(self.topology, Topology)
        return self.topology

    @property
    def precision(self) -> Precision:
        """How exactly coordinates are known."""
        return precision_of(self.mesh)

    def run_start(self, best_by: str) -> Start:
        """Where a run over the whole mesh starts."""
        score = None if self.totals is None else Score.of(self.totals, best_by)
        return Start(
            self.topology, self.points, self.precision, score, self.history, self.constraint, self.curved, self.metric
        )  # fmt: skip

    @property
    def constraint(self) -> Constraint | Surface | None:
        """What nodes slide on."""
        return None if self.sliding is None else self.sliding.constraint

    def ended(self, stop_reason: str, interruption: KeyboardInterrupt | None = None) -> State:
        """The same, and why the sweeps ended."""
        return replace(self, stop_reason=stop_reason, interruption=interruption)

    @property
    def cut_short(self) -> bool:
        """Was it ended from outside, by the callback or an interruption?"""
        return self.stop_reason == CALLBACK or self.interruption is not None

    def ended_as(self, other: State) -> State:
        """The same; ended from outside if the other one was."""
        return self.ended(other.stop_reason, other.interruption) if other.cut_short else self

    def interrupted(self, interruption: KeyboardInterrupt) -> State:
        """The same, interrupted. Raises the second interruption: who asks twice does not want to wait."""
        if self.interruption is not None:
            raise interruption
        return self.ended(INTERRUPTED, interruption)


def with_corners(state: State) -> Topology | Volume:
    """The topology; of second-order cells with the corners free that were."""
    given = state.second_order
    if given is None:
        return state.topology
    free = _near_free_by_id(given.protection.topology) & given.free
    return given.whole.holding(~(free | _near_free_by_id(state.topology)), OF_SECOND_ORDER)


def _near_free_by_id(topology: Topology | Volume) -> NDArray[np.bool_]:
    free = np.zeros(len(topology.memory), dtype=bool)
    free[topology.free] = True
    return free

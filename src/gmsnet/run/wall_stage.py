"""The last stage of a run: near walls that a mesh is refined towards, shapes get better within bands of the areas."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from gmsnet.mesh.mesh import Mesh
from gmsnet.methods.sized import banded
from gmsnet.run.run import Run
from gmsnet.run.stop import MAX_SWEEPS, NO_PROGRESS
from gmsnet.run.sweep import Sweep
from gmsnet.topology.topology import Topology, near_points

Floats = NDArray[np.float64]

SWEEPS = 20  # at most
STAGE = "near walls, areas kept"
ELSEWHERE = "not near a wall"


def improve_near_walls(
    mesh: Mesh, topology: Topology, kept: NDArray[np.bool_], points: Floats, history: list[Sweep], *,
    threads: int, best_by: str, guard: str, max_sweeps: int = 1000,
    callback: Callable[[Sweep], bool | None] | None = None,
) -> tuple[Floats, str, list[Sweep]]:  # fmt: skip
    """Moves the free nodes among ``kept`` alone; each cell whose corners all are keeps its area within a tenth.

    topology: of the mesh, in which the nodes near walls are not held on that account. kept: (N,) bool by id, from
    ``walls.near_walls``. points: (N, 2) in memory order, where other stages have left the mesh, with the kept nodes
    where they are in ``mesh``; not changed. history: to go on with. max_sweeps: with those of the history.

    Returns the new points, why it ended, and the record.
    """
    zone = topology.holding(~kept, ELSEWHERE)
    smoother = banded(near_points(mesh, topology), kept[topology.memory])
    smoother.stage = STAGE
    run = Run(mesh, zone, smoother, threads, best_by, guard, points=points, history=history)
    stop_reason = run.to_the_end(min(run.sweeps + SWEEPS, max_sweeps), callback)
    if stop_reason == MAX_SWEEPS and run.sweeps < max_sweeps:
        stop_reason = NO_PROGRESS  # of the stage's own sweeps
    return run.best, stop_reason, run.history

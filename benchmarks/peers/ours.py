"""gmsnet.smooth: the whole call, from arrays to arrays and both reports; the effort is max_sweeps."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

import gmsnet
from gmsnet.mesh.adapters import to_mesh
from gmsnet.methods import smoother
from gmsnet.parallel.threads import workers
from gmsnet.run.options import SmoothOptions
from gmsnet.run.run import Run, Start
from gmsnet.topology.topology import Topology
from peers.mixed import mesh_of
from peers.peer import Plane

EVERY, APART, MOST = 12, 1.25, 400  # efforts one by one up to EVERY, then each APART times the last; sweeps at most


def spread(last: int) -> tuple[int, ...]:
    """Efforts from one sweep to so many."""
    wanted = {*range(1, EVERY), *(round(EVERY * APART**k) for k in range(20)), last}
    return tuple(sorted(effort for effort in wanted if effort <= last))


class Smooth:
    def __init__(self, plane: Plane, method: str, threads: int = 1, **options: str) -> None:
        self.arrays = mesh_of(plane) if len(plane.quads) else (plane.points, plane.cells)
        self.method, self.options, self.threads = method, options, threads

    def smooth(self, effort: int) -> None:
        self.result = gmsnet.smooth(self.arrays, self.method, max_sweeps=effort, threads=self.threads, **self.options)

    def points(self) -> np.ndarray:
        return self.result.points

    def cells(self) -> np.ndarray | None:
        return self.result.mesh[1] if isinstance(self.arrays, tuple) else None

    def efforts(self) -> tuple[int, ...]:
        """From one sweep to all that the method makes."""
        self.smooth(MOST)
        return spread(self.result.sweeps)

    def smoothing_alone(self, effort: int, clock: Callable[[], float] = time.process_time) -> float:
        """Seconds for the sweeps and the looks between them, when all else is there."""
        mesh, _ = to_mesh(self.arrays)
        topology, guard = Topology.of(mesh), self.options.get("guard", "worst")
        names = {key: self.options[key] for key in ("variant", "objective") if key in self.options}
        seconds = []
        options = SmoothOptions(guard=guard)
        with workers(self.threads) as executor:
            for _ in range(2):  # what is made when it is first asked for is made in the first
                run = Run(Start.of(mesh, topology), smoother(self.method, **names), options, executor)
                began = clock()
                run.to_the_end(effort)
                seconds.append(clock() - began)
        return seconds[-1]

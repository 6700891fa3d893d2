"""What smoothing is measured against: converged whole-mesh optimisation, and how far q̂ can be brought on a mesh at all.

    python benchmarks/reference.py [--nodes 1e3 1e4 1e5] [--seeds 0 1 2 3 4] [--json benchmarks/ceilings.json]

The meshes are random squares. What stands in the file already is not computed again.

For quads and mixed meshes there is a reference only (``quad_ceiling``; quads.py).

*Reference*: L-BFGS (``barrier``) over all free nodes at once on the mean of q, from there on that of q², and from there
on that of q⁴, each until no node alone would still go 1e-6 of its mean distance from its neighbours. From two starts,
the mesh itself and the mesh after five smart Laplacian sweeps; the end with the larger q̂ counts. (On all meshes of
1,000 and 10,000 nodes both end in the same minimum, to 1e-5 in q̂ and min 1/q; beyond 20,000 nodes there is one start.)

*Ceiling*: the best q̂ that was met on any road. A road starts at each of the three minima on the way to the reference,
of q, q² and q⁴. From there it is the worst cells' turn: the nodes of the worst share of the cells, and so many rings
around them, L-BFGS on the mean of (q/q_max)^p over the cells that they touch, for the shares and powers in SCHEDULE,
again and again until q̂ does not gain 1e-6 any more in a round, for each number of rings in RINGS. (Roads from the
minima of q⁸ and q¹⁶, and with four rings, were tried on two meshes each of 1,000 and 10,000 nodes: none came out on
top.)

*Polished*: what the three best roads still gain when the mean has its turn: sweeps of Newton's method on 1 − 1/q
star by star, which may spoil no star whose worst 1/q is near the mesh's. The floor of a star is its own worst 1/q or
(1.02, 1.05, 1.1 times) the mesh's, whichever is less; the best q̂ after any sweep counts.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from barrier import Minimum, Problem, aspects, minimise
from corners import Corners
from machine import describe

import gmsnet
from gmsnet.kernels.star.guard import LARGEST, STAR, Precision, StarGuard
from gmsnet.measure.report import measure
from gmsnet.mesh.mesh import Mesh
from gmsnet.methods import Field, smoother
from gmsnet.parallel.executor import Executor
from gmsnet.parallel.threads import serial
from gmsnet.topology.ordering import planar_points
from gmsnet.topology.topology import Topology

RECIPE = " ".join(__doc__[__doc__.index("*Reference*") :].split())
KEYS = ("qhat", "min_shape", "mean_shape")
POWERS = (1, 2, 4)
SCHEDULE = ((3e-3, 8), (1e-3, 16), (1e-3, 32), (3e-4, 64), (3e-4, 128), (3e-4, 256))
FEWEST = 4  # cells of a share
RINGS = (0, 1, 2)
ROUNDS, LEAST_GAIN = 20, 1e-6
CLOSE = 1e-4  # tolerance on the worst cells
SMART_SWEEPS, MOST_TWICE = 5, 20_000
POLISHED_ROADS, POLISH_SWEEPS, ABOVE_WORST = 3, 10, (1.02, 1.05, 1.1)


@dataclass(frozen=True, eq=False)
class Plane:
    """A planar triangle mesh as the optimiser sees it: points in memory order, scaled as in ``planar_points``."""

    mesh: Mesh
    topology: Topology
    problem: Problem
    start: np.ndarray

    @classmethod
    def of(cls, mesh: Mesh) -> Plane:
        topology = Topology.of(mesh)
        triangles = np.where(topology.near_orientation[:, None] > 0, topology.near, topology.near[:, ::-1])
        right = np.zeros(len(triangles), dtype=bool)
        problem = Problem(np.ascontiguousarray(triangles, dtype=np.int32), topology.near_colours >= 0, right)
        return cls(mesh, topology, problem, planar_points(mesh)[topology.memory])

    def written(self, planar: np.ndarray) -> np.ndarray:
        """(N, dim) points of the mesh, in its order, from planar ones in memory order."""
        points = self.mesh.points.copy()
        free = self.problem.free
        ids = self.topology.memory[free]
        points[np.ix_(ids, self.topology.plane)] = np.ldexp(planar[free], self.mesh.exponent)
        return points

    def read(self, points: np.ndarray) -> np.ndarray:
        """The other way."""
        return planar_points(self.mesh.with_points(points))[self.topology.memory]

    def figures(self, planar: np.ndarray) -> dict[str, float]:
        """q̂ and what else is compared, as gmsnet measures it."""
        return figures(self.mesh.with_points(self.written(planar)), self.topology)


def figures(mesh: Mesh, topology: Topology | None = None) -> dict[str, float]:
    """q̂, least and mean 1/q, least and largest angle, cells that are not positive."""
    report = measure(mesh, topology)
    return {
        "qhat": report.qhat,
        "min_shape": float(report.shape.min()),
        "mean_shape": float(report.shape.mean()),
        "min_angle": float(report.min_angle.min()),
        "max_angle": float(report.max_angle.max()),
        "inverted": report.inverted,
    }


def continuation(plane: Plane, start: np.ndarray, powers: Sequence[int] = POWERS) -> list[Minimum]:
    """The minimum for each power, each from where the one before it ended."""
    minima: list[Minimum] = []
    for power in powers:
        minima.append(minimise(plane.problem, minima[-1].points if minima else start, power))
    return minima


def starts(plane: Plane) -> dict[str, np.ndarray]:
    """The mesh itself, of which no cell is inverted, and up to MOST_TWICE nodes also after smart Laplacian sweeps."""
    if len(plane.start) > MOST_TWICE:
        return {"mesh": plane.start}
    smart = gmsnet.smooth(plane.mesh, "laplacian", variant="smart", max_sweeps=SMART_SWEEPS, threads=1).points
    return {"mesh": plane.start, "laplacian": plane.read(smart)}


def lbfgs(mesh: Mesh, powers: Sequence[int] = POWERS) -> np.ndarray:
    """The reference: (N, dim) points. Raises ValueError if a cell of the mesh has no positive area."""
    plane = Plane.of(mesh)
    ends = [continuation(plane, start, powers)[-1].points for start in starts(plane).values()]
    return plane.written(max(ends, key=lambda points: plane.figures(points)["qhat"]))


def quad_ceiling(mesh: Mesh, powers: Sequence[int] = POWERS) -> tuple[np.ndarray, dict[str, float]]:
    """The reference of a planar mesh of quads, or of quads and triangles: (N, dim) points, and ``Corners.figures``.

    The means are over the simplices, of which a quad has four. There is one start, the mesh itself. Raises ValueError
    for cells of other kinds, and if a corner of the mesh is not positive.
    """
    corners = Corners.of(mesh)
    found = planar_points(mesh)
    for power in powers:
        found = minimise(corners.problem, found, power).points
    points = corners.written(found)
    return points, corners.figures(points)


def ceiling(mesh: Mesh, start_points: Sequence[np.ndarray]) -> np.ndarray:
    """(N, dim) points with the best q̂ met on the roads from these starts, (N, dim) each, all cells positive."""
    plane = Plane.of(mesh)
    return plane.written(climb(plane, [plane.read(points) for points in start_points])[0].points)


@dataclass(frozen=True, eq=False)
class Met:
    """Points that were met on a road, planar in memory order, and their figures."""

    points: np.ndarray
    figures: dict[str, float]


def best(plane: Plane, met: Iterable[np.ndarray]) -> Met:
    """Those with the best q̂."""
    return max((Met(points, plane.figures(points)) for points in met), key=lambda each: each.figures["qhat"])


def climb(plane: Plane, begins: Sequence[np.ndarray]) -> list[Met]:
    """The best of each road from these starts, the best road first."""
    tops = [best(plane, road(plane, start, rings)) for start in begins for rings in RINGS]
    return sorted(tops, key=lambda top: -top.figures["qhat"])


def road(plane: Plane, start: np.ndarray, rings: int) -> Iterator[np.ndarray]:
    """What is met on one road: the start, and the points after each power of each round."""
    yield start
    points, gained = start, plane.figures(start)["qhat"]
    q = np.empty(len(plane.problem.triangles))
    for _ in range(ROUNDS):
        before = gained
        for share, power in SCHEDULE:
            aspects(points, plane.problem.triangles, plane.problem.right, q)
            count = min(max(FEWEST, round(share * len(q))), len(q))
            part, nodes = plane.problem.part(np.argpartition(q, len(q) - count)[len(q) - count :], rings)
            if not part.free.any():
                return
            points = points.copy()
            points[nodes] = minimise(part, points[nodes], power, top=float(q.max()), tolerance=CLOSE, most=500).points
            gained = max(gained, plane.figures(points)["qhat"])
            yield points
        if gained < before + LEAST_GAIN:
            return


class Capped(Field):
    """A field whose stars may become as bad as ``cap`` (of 1/q), however good they are."""

    def __init__(self, points: np.ndarray, topology: Topology, cap: float) -> None:
        super().__init__(points, topology, Precision(), STAR)
        self.cap = cap

    def guard(self, executor: Executor) -> StarGuard:
        """See Field."""
        guard = super().guard(executor)
        return guard._replace(floors=np.minimum(guard.floors, self.cap * LARGEST))


def polish(plane: Plane, points: np.ndarray) -> Iterator[np.ndarray]:
    """The points, and what sweeps for the mean make of them that spare the worst cells."""
    yield points
    worst = plane.figures(points)["min_shape"]
    for above in ABOVE_WORST:
        field = Capped(points.copy(), plane.topology, above * worst)
        newton = smoother("optimize", variant="newton", objective="metric")
        for _ in range(POLISH_SWEEPS):
            newton.sweep(field, serial, lambda: False)
            yield field.points.copy()


def study(nodes: int, seed: int) -> dict[str, object]:
    """Reference and ceiling of one random square, with how the minima were reached."""
    plane = Plane.of(gmsnet.random_mesh(nodes, seed=seed))
    minima, ends = {}, {}
    for name, start in starts(plane).items():
        began = time.perf_counter()
        found = continuation(plane, start)
        seconds = time.perf_counter() - began
        ends[name] = [minimum.points for minimum in found]
        minima[name] = {**plane.figures(found[-1].points), "seconds": seconds, "steps": [reached(m) for m in found]}
    chosen = max(ends, key=lambda name: minima[name]["qhat"])
    began = time.perf_counter()
    tops = climb(plane, ends[chosen])
    seconds = time.perf_counter() - began
    polished = best(plane, (points for top in tops[:POLISHED_ROADS] for points in polish(plane, top.points)))
    return {
        "input": plane.figures(plane.start),
        "reference": {key: minima[chosen][key] for key in polished.figures},
        "reference_start": chosen,
        "ceiling": {**tops[0].figures, "seconds": seconds},
        "polished": polished.figures,
        "minima": minima,
    }


def reached(minimum: Minimum) -> dict[str, object]:
    """How a minimum was reached, without its points."""
    return {key: value for key, value in asdict(minimum).items() if key != "points"}


def stored(path: Path, sizes: Sequence[int], seeds: Sequence[int]) -> dict[str, dict[str, object]]:
    """ "nodes/seed" → ``study``; what the file does not have is computed and added to it at once."""
    document = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    found = document.setdefault("meshes", {})
    for nodes in sizes:
        for seed in seeds:
            if f"{nodes}/{seed}" in found:
                continue
            began = time.perf_counter()
            found[f"{nodes}/{seed}"] = study(nodes, seed)
            seconds = time.perf_counter() - began
            document |= {"machine": describe(), "recipe": RECIPE}
            path.write_text(json.dumps(document, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
            print(f"{nodes:,} nodes, seed {seed}: {seconds:.0f} s", flush=True)
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--nodes", nargs="+", type=float, default=[1e3, 1e4, 1e5])
    parser.add_argument("--seeds", nargs="+", type=int, default=[0, 1, 2, 3, 4])
    parser.add_argument("--json", type=Path, default=Path(__file__).with_name("ceilings.json"))
    options = parser.parse_args()
    print(describe())
    sizes = [int(nodes) for nodes in options.nodes]
    found = stored(options.json, sizes, options.seeds)
    print("\n              q̂                             min 1/q                       mean 1/q")
    print("  nodes/seed " + 3 * "  reference   ceiling  polished")
    for nodes in sizes:
        for seed in options.seeds:
            row = found[f"{nodes}/{seed}"]
            values = [row[kind][key] for key in KEYS for kind in ("reference", "ceiling", "polished")]
            print(f"  {nodes:7}/{seed}   ", *(f"{value:9.4f}" for value in values))


if __name__ == "__main__":
    main()

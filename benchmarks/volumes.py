"""Meshes of tetrahedra: the default beside whole-mesh optimisation, and where its time goes.

    python benchmarks/volumes.py [FILE ...] [--cubes 1e4] [--seeds 0 1 2 3 4] [--reference]

Without files: random Delaunay cubes. L₃ is one product of SciPy's averaging matrix (free rows average the nodes that
share an edge) with the (N, 3) coordinates in memory order, over the number of free nodes, in the same run. Times are of
the processor, one thread, the least of REPEATS. Figures are over the cells with a free node.

*Reference*: L-BFGS over all free nodes at once on the sum of (q/q_max)^p, q = 1/η, for p = 1, 2, 4 and 8, each from
where the one before it ended. Its first Hessian is diagonal, and each step is halved until the sum falls.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import numba
import numpy as np
import scipy.sparse
import scipy.spatial
from machine import describe

import gmsnet
from gmsnet.measure.report import measure
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.topology.ordering import space_points
from gmsnet.topology.volume import Volume

REPEATS = 3
ITERATIONS, PAIRS, PATIENCE = 3000, 10, 10
POWERS = (1, 2, 4, 8)


def cube(nodes: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """A random Delaunay cube with an evenly spaced grid of nodes on its sides: points (N, 3), cells (T, 4)."""
    random, side = np.random.default_rng(seed), max(2, round(nodes ** (1 / 3)))
    line = np.linspace(0.0, 1.0, side)
    grid = np.stack(np.meshgrid(line, line, line, indexing="ij"), -1).reshape(-1, 3)
    sides = grid[((grid == 0.0) | (grid == 1.0)).any(axis=1)]
    inner = random.random((nodes - len(sides), 3)) * (1.0 - 1.0 / side) + 0.5 / side
    points = np.concatenate([sides, inner])
    cells = scipy.spatial.Delaunay(points, qhull_options="QJ").simplices
    a, b, c = (points[cells[:, k]] - points[cells[:, 0]] for k in (1, 2, 3))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c))
    cells[volume < 0.0] = cells[volume < 0.0][:, [0, 2, 1, 3]]
    return points, cells[np.abs(volume) > 1e-9]


@numba.njit(cache=True)
def energy(points, cells, power, scale, gradient, weight):
    """The sum of (q/scale)^power, its gradient (N, 3), about its second derivatives weight (N,), and the largest q.

    Infinite where a volume is not positive.
    """
    total, largest = 0.0, 0.0
    gradient[:] = 0.0
    weight[:] = 0.0
    sides, normals = np.empty((4, 3)), np.empty((4, 3))
    for t in range(len(cells)):
        p, a, b, c = points[cells[t, 0]], points[cells[t, 1]], points[cells[t, 2]], points[cells[t, 3]]
        u, v, w = a - p, b - p, c - p
        normals[1] = np.cross(v, w)
        normals[2] = np.cross(w, u)
        normals[3] = np.cross(u, v)
        normals[0] = -(normals[1] + normals[2] + normals[3])
        double = (u * normals[1]).sum()
        if not double > 0.0:
            return np.inf, np.inf
        for k in range(4):
            sides[k] = 4.0 * points[cells[t, k]] - (p + a + b + c)
        lengths = ((a - p) ** 2).sum() + ((b - p) ** 2).sum() + ((c - p) ** 2).sum()
        lengths += ((b - a) ** 2).sum() + ((c - b) ** 2).sum() + ((a - c) ** 2).sum()
        q = lengths / (6.0 * 2.0 ** (1.0 / 3.0) * double ** (2.0 / 3.0))
        largest = max(largest, q)
        f = (q / scale) ** power
        total += f
        for k in range(4):
            node = cells[t, k]
            square = 0.0
            for axis in range(3):
                change = 2.0 * sides[k, axis] / lengths - 2.0 / 3.0 * normals[k, axis] / double
                gradient[node, axis] += power * f * change
                square += change * change
            weight[node] += power * f * (6.0 / lengths + (power + 1.0) * square)
    return total, largest


def reference(points: np.ndarray, cells: np.ndarray, free: np.ndarray) -> list[np.ndarray]:
    """Where L-BFGS ends for each of POWERS. cells of positive volume. free: (N,) bool."""
    ends = []
    for power in POWERS:
        points = minimum(points, cells, free, power)
        ends.append(points)
    return ends


def minimum(points: np.ndarray, cells: np.ndarray, free: np.ndarray, power: float, energy=energy) -> np.ndarray:
    """One of them. energy: of the cells, as ``energy``."""
    points, gradient, weight = points.copy(), np.empty_like(points), np.empty(len(points))
    _, scale = energy(points, cells, power, 1.0, gradient, weight)
    value, _ = energy(points, cells, power, scale, gradient, weight)
    slope, pairs, quiet = gradient[free].ravel(), list[tuple[np.ndarray, np.ndarray, float]](), 0
    for _ in range(ITERATIONS):
        way, shares = -slope, []
        for step, change, inner in reversed(pairs):
            shares.append(step @ way / inner)
            way = way - shares[-1] * change
        way = way / np.repeat(weight[free], 3)
        for (step, change, inner), share in zip(pairs, reversed(shares), strict=True):
            way = way + (share - change @ way / inner) * step
        if not slope @ way < 0.0:
            pairs, way = [], -slope / np.repeat(weight[free], 3)
        length, found = 1.0, np.inf
        start, before = points[free].ravel(), slope
        while length > 1e-8 and not found < value + 1e-4 * length * (slope @ way):
            points[free] = (start + length * way).reshape(-1, 3)
            found, _ = energy(points, cells, power, scale, gradient, weight)
            length *= 0.5
        if not found < value:
            points[free] = start.reshape(-1, 3)
            break
        quiet = quiet + 1 if value - found < 1e-9 * value else 0
        value, slope = found, gradient[free].ravel().copy()
        step, change = points[free].ravel() - start, slope - before
        if step @ change > 0.0:
            pairs = [*pairs[1 - PAIRS :], (step, change, float(step @ change))]
        if quiet == PATIENCE:
            break
    return points


def figures(mesh: Mesh, volume: Volume) -> str:
    """Over the cells with a free node."""
    report = measure(mesh, volume)
    free = np.zeros(len(mesh.points), dtype=bool)
    free[volume.free] = True
    own = free[volume.cells].any(axis=1)
    low, high = report.min_dihedral[own].min(), report.max_dihedral[own].max()
    shape = report.shape[own]
    return f"least η {shape.min():.4f}, mean η {shape.mean():.4f}, dihedral {low:.2f}–{high:.2f}"


def least(job: Callable[[], object]) -> float:
    """Seconds of the processor, the least of REPEATS."""
    found = []
    for _ in range(REPEATS):
        began = time.process_time()
        job()
        found.append(time.process_time() - began)
    return min(found)


def product(mesh: Mesh, volume: Volume) -> float:
    """Seconds of one averaging product."""
    pairs = np.concatenate([volume.near[:, [a, b]] for a in range(4) for b in range(4) if a != b])
    count = len(mesh.points)
    matrix = scipy.sparse.csr_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    matrix.sum_duplicates()
    matrix.data[:] = 1.0
    matrix = scipy.sparse.csr_array(scipy.sparse.diags_array(volume.near_free.astype(float)) @ matrix)
    matrix.eliminate_zeros()
    points = np.ascontiguousarray(space_points(mesh)[volume.memory][:, :3])
    return min(least(lambda: matrix @ points) for _ in range(3))


def run(name: str, mesh: Mesh, against: bool) -> None:
    """One mesh."""
    volume = Volume.of(mesh)
    print(f"\n{name}: {len(mesh.points):,} nodes, {len(volume.free):,} free, {len(volume.cells):,} tetrahedra")
    print(f"  input      {figures(mesh, volume)}")
    seconds = least(lambda: gmsnet.smooth(mesh, threads=1))
    one, set_up = product(mesh, volume), least(lambda: Volume.of(mesh).stars)
    result = gmsnet.smooth(mesh, threads=1)
    print(f"  default    {figures(result.mesh, volume)}, {result.sweeps} sweeps")
    nodes = len(volume.free)
    print(
        f"  call {seconds / one:.0f} L₃ ({seconds:.3f} s, {nodes / seconds:,.0f} free nodes a second), set-up "
        f"{set_up / one:.0f} L₃, L₃ {one / nodes * 1e9:.0f} ns"
    )
    if against:
        free = np.zeros(len(mesh.points), dtype=bool)
        free[volume.free] = True
        cells = np.where(volume.orientation[:, None] > 0, volume.cells, volume.cells[:, [0, 2, 1, 3]])
        began = time.process_time()
        for power, points in zip(POWERS, reference(mesh.points, cells, free), strict=True):
            print(f"  L-BFGS q^{power} {figures(mesh.with_points(points), volume)}")
        print(f"  L-BFGS took {(time.process_time() - began) / one:,.0f} L₃")


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="*")
    parser.add_argument("--cubes", nargs="*", type=float, default=[1e4])
    parser.add_argument("--seeds", nargs="*", type=int, default=range(5))
    parser.add_argument("--reference", action="store_true")
    arguments = parser.parse_args()
    print(describe())
    for file in arguments.files:
        run(file, gmsnet.read(file), arguments.reference)
    if not arguments.files:
        for nodes in arguments.cubes:
            for seed in arguments.seeds:
                points, cells = cube(int(nodes), seed)
                run(f"random cube, seed {seed}", Mesh(points, _blocks(cells)), arguments.reference)


def _blocks(cells: np.ndarray) -> tuple[CellBlock, ...]:
    return (CellBlock("tetra", cells, np.zeros(len(cells), dtype=np.int64)),)


if __name__ == "__main__":
    main()

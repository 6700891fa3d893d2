"""gmsnet.smooth beside other tools on hexahedra, the boundary held, connectivity kept.

    python benchmarks/hexes.py [--meshes NAME ...] [--tools NAME ...] [--limit 120] [--tangles 100]

Each tool runs in a process of its own, one after the other (peers/volume_tools.py). Told are seconds of the processor,
of gmsnet for the whole call, and the least and the mean η and scaled Jacobian over the cells with a free node; cells
that are not valid everywhere are counted among all. MESQUITE_VOLUMES names Mesquite's program
(peers/mesquite_volumes.cpp). "whole mesh" is L-BFGS on the mean of q^(3/2) over all corners, then on its powers 2, 4
and 8; where the input is not valid, it starts from gmsnet's end.

--tangles counts how many of so many generated meshes with thrown nodes become valid: blocks and swept O-grids, nodes
thrown by 0.5, 1 and 2 of their mean edges; of each the mesh before the throw is valid. And half as many of wedges,
pyramids and mixed volumes.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numba
import numpy as np
from apart import made_by
from machine import describe
from peers.volume_tools import MESQUITE, gmsnet_with, mesquite, mfem_tmop
from volumes import minimum

import gmsnet
from gmsnet.cells.hexahedron import HEXAHEDRON
from gmsnet.generate import block_volume, disturb, o_grid_section, swept_volume
from gmsnet.generate.marked_volume import outer_faces
from gmsnet.mesh.mesh import Mesh
from gmsnet.topology.mixed_volume import volume_of, wound_of

POWERS = (1, 2, 4, 8)


def thrown(mesh: Mesh, amount: float, seed: int) -> Mesh:
    """With each free node thrown by so many of its edges."""
    return disturb(mesh, volume_of(wound_of(mesh)).free, amount, seed=seed, keep_valid=False)


def o_grid(seed: int) -> Mesh:
    """A swept O-grid by number: straight, twisted and bent ones."""
    around, rings, layers = 6 + seed % 5, 3 + seed % 4, 12 + 2 * seed
    section = o_grid_section(around, rings, radius=0.5)
    return swept_volume(section, layers, 3.0, twist=15.0 * (seed % 4), bend=(0.0, 45.0, 90.0)[seed % 3])


def of_file(name: str) -> Callable[[], Mesh]:
    return lambda: gmsnet.read(Path(os.environ["GMSNET_MESHES"], name))


MESHES: dict[str, Callable[[], Mesh]] = {
    "pave2.e.vtk": of_file("pave2.e.vtk"),
    "can.vtu": of_file("can.vtu"),
    **{f"O-grid {seed}": partial(lambda seed: thrown(o_grid(seed), 0.3, seed), seed) for seed in range(10)},
    "block, 0.3 edges": lambda: thrown(block_volume(24), 0.3, 0),
}


@numba.njit(cache=True)
def energy_of_cubes(points, rows, power, scale, gradient, weight):
    """As volumes.energy with q^(3/2) of the corners of cubes, rows (T, 4) from the corner."""
    total, largest = 0.0, 0.0
    gradient[:] = 0.0
    weight[:] = 0.0
    for t in range(len(rows)):
        p = points[rows[t, 0]]
        u, v, w = points[rows[t, 1]] - p, points[rows[t, 2]] - p, points[rows[t, 3]] - p
        a, b, c = np.cross(v, w), np.cross(w, u), np.cross(u, v)
        double, lengths = (u * a).sum(), (u * u).sum() + (v * v).sum() + (w * w).sum()
        if not double > 0.0:
            return np.inf, np.inf
        q = (lengths / 3.0) ** 1.5 / double
        largest = max(largest, q)
        f = (q / scale) ** power
        total += f
        for k in range(4):
            node, square = rows[t, k], 0.0
            for axis in range(3):
                side = -(u[axis] + v[axis] + w[axis])
                normal = -(a[axis] + b[axis] + c[axis])
                if k == 1:
                    side, normal = u[axis], a[axis]
                elif k == 2:
                    side, normal = v[axis], b[axis]
                elif k == 3:
                    side, normal = w[axis], c[axis]
                change = 3.0 * side / lengths - normal / double
                gradient[node, axis] += power * f * change
                square += change * change
            weight[node] += power * f * ((9.0 if k == 0 else 3.0) / lengths + (power + 1.0) * square)
    return total, largest


def whole_mesh(points, cells, faces, held) -> tuple[np.ndarray, float]:
    """L-BFGS over all free nodes at once."""
    rows = cells[:, HEXAHEDRON.simplices].reshape(-1, 4)
    if not np.isfinite(energy_of_cubes(points, rows, 1.0, 1.0, np.empty_like(points), np.empty(len(points)))[0]):
        points, _ = gmsnet_with()(points, cells, faces, held)
    began = time.process_time()
    for power in POWERS:
        points = minimum(points, rows, ~held, float(power), energy_of_cubes)
    return points, time.process_time() - began


TOOLS = {
    "gmsnet": gmsnet_with(),
    "whole mesh": whole_mesh,
    "MFEM TMOP 303": mfem_tmop(303, 60),
    "Mesquite ShapeImprovementWrapper": mesquite("ShapeImprovementWrapper"),
    "Mesquite ShapeImprover": mesquite("ShapeImprover"),
    "Mesquite UntangleWrapper": mesquite("UntangleWrapper"),
}


class Case:
    """A mesh of hexahedra as arrays in a file, and how a result is judged."""

    def __init__(self, mesh: Mesh, path: Path) -> None:
        cells = np.concatenate([block.nodes for block in mesh.cells if block.kind == "hexahedron"])
        used, rows = np.unique(cells, return_inverse=True)
        self.cells, self.points, self.path = rows.reshape(cells.shape), mesh.points[used], path
        free = np.zeros(len(mesh.points), dtype=bool)
        free[volume_of(wound_of(mesh)).free] = True
        self.held = ~free[used]
        self.own = ~self.held[self.cells].all(axis=1)
        np.savez(path, self.points, self.cells, outer_faces({"hexahedron": self.cells})["quad"], self.held)

    def line(self, name: str, points: np.ndarray, seconds: float | None) -> str:
        """A row of the table."""
        report = gmsnet.quality((points, [("hexahedron", self.cells)]))
        shape, scaled = report.shape[self.own], report.scaled_jacobian[self.own]
        figures = (shape.min(), shape.mean(), scaled.min(), scaled.mean())
        away = float(np.abs(points - self.points)[self.held].max(initial=0.0))
        odd = f"  moved held nodes by {away:.0e}" if away else ""
        spent = " " * 9 if seconds is None else f"{seconds:9.3f}"
        return f"  {name:34}{''.join(f'{each:9.4f}' for each in figures)}{report.inverted:8}{spent}{odd}"

    def run(self, tool: str, limit: float) -> tuple[np.ndarray, float] | str:
        """What a tool makes of it, and its seconds; or why there is nothing."""
        return made_by(Path(__file__), tool, self.path, limit)


def compare(name: str, case: Case, tools: list[str], limit: float) -> None:
    """The table of one mesh."""
    print(f"\n{name}: {len(case.points):,} nodes, {(~case.held).sum():,} free, {len(case.cells):,} hexahedra")
    print(f"  {'':34}{'least η':>9}{'mean':>9}{'least SJ':>9}{'mean':>9}{'invalid':>8}{'seconds':>9}")
    print(case.line("input", case.points, None), flush=True)
    for tool in tools:
        found = case.run(tool, limit)
        print(f"  {tool:34} {found}" if isinstance(found, str) else case.line(tool, *found), flush=True)


def tangles(count: int) -> Iterator[tuple[str, Mesh]]:
    """Meshes with thrown nodes."""
    kinds: dict[str, Callable[[int], Mesh]] = {
        "block": lambda k: block_volume(4 + k % 5), "O-grid": lambda k: o_grid(k % 6),
    }  # fmt: skip
    others: dict[str, Callable[[int], Mesh]] = {
        kind: partial(lambda kind, k: block_volume(3 + k % 3, kind), kind) for kind in ("wedge", "pyramid", "mixed")
    }
    for names, most in ((kinds, count), (others, count // 2)):
        for k in range(most):
            name = list(names)[k % len(names)]
            amount = (0.5, 1.0, 2.0)[k // len(names) % 3]
            yield f"{name} {k}, {amount} edges", thrown(names[name](k // (3 * len(names))), amount, k)


def untangle(count: int) -> None:
    """How many of them become valid."""
    tried, left = 0, []
    for name, mesh in tangles(count):
        result, tried = gmsnet.smooth(mesh, threads=1), tried + 1
        found = gmsnet.quality(result.mesh)
        if found.inverted:
            left.append(f"{name}: {found.inverted} of {len(found.cell)} cells")
    print(f"\n{tried - len(left)} of {tried} tangled meshes became valid", *left, sep="\n  ")


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--meshes", nargs="*", choices=list(MESHES), default=list(MESHES), metavar="NAME")
    parser.add_argument("--tools", nargs="+", choices=list(TOOLS), default=list(TOOLS), metavar="NAME")
    parser.add_argument("--limit", type=float, default=120.0, help="seconds after which a process is ended")
    parser.add_argument("--tangles", type=int, default=0)
    parser.add_argument("--work", nargs=3, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.work:
        tool, source, target = options.work
        with np.load(source) as arrays:
            points, seconds = TOOLS[tool](*(arrays[f"arr_{k}"] for k in range(4)))
        np.savez(target, points=points, seconds=seconds)
        return
    print(describe())
    tools = [tool for tool in options.tools if MESQUITE in os.environ or not tool.startswith("Mesquite")]
    if len(tools) < len(options.tools):
        print(f"{MESQUITE} names no program: Mesquite is left out")
    with tempfile.TemporaryDirectory() as folder:
        for name in options.meshes:
            compare(name, Case(MESHES[name](), Path(folder, "mesh.npz")), tools, options.limit)
    if options.tangles:
        untangle(options.tangles)


if __name__ == "__main__":
    main()

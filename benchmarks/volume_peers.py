"""gmsnet.smooth beside other tools that move the nodes of tetrahedra and keep their connectivity, in one table.

    python benchmarks/volume_peers.py [--meshes NAME ...] [--tools NAME ...] [--repeats 3] [--limit 300]
        [--times]

Each tool runs in a process of its own, one after the other, in turns: first all once, then again. Told are the least
seconds of the processor (peers/volume_tools.py says of what), and figures over the cells with a free node; inverted
ones are counted among all. The boundary is held for all. What to install: peers/requirements.txt; Mesquite is compiled
(peers/mesquite_volumes.cpp), and MESQUITE_VOLUMES names the program. A tool that is not there is left out, and said so.

gmsnet runs twice, the second time with a minimum dihedral angle that is a sixth more than it reaches without.

--times tells how many times as fast gmsnet comes to a tool's own mean η, and apart from that to its own least η. Calls
of gmsnet that stop after 0, 1, 2, … sweeps tell when it is there: whole calls, the least of three, and the cheapest of
the ways (peers/volume_tools.py) counts. In brackets: how many times if it came there in its first sweep. "–": the tool
does not better the input, or gmsnet does not come there. "whole": the tool's seconds over those of the default.
"""

from __future__ import annotations

import argparse
import os
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from apart import made_by
from machine import describe
from peers.ours import spread
from peers.results import MEAN, MIN, level_to
from peers.volume_tools import MESQUITE, TOOLS, WAYS, tool_named
from volumes import _blocks, cube

import gmsnet
from gmsnet.generate import disturb
from gmsnet.generate.marked_volume import outer_faces
from gmsnet.generate.volumes import lattice_volume, part_volume
from gmsnet.mesh.mesh import Mesh
from gmsnet.topology.volume import Volume

SLOW = 5.0  # seconds: of tools that take longer one run is enough
MORE = 7.0 / 6.0  # of the smallest angle: what is asked of gmsnet beside its default
MOST = 40  # sweeps of calls that stop early

Level = dict[str, Any]


def jittered(mesh: Mesh) -> Mesh:
    return disturb(mesh, Volume.of(mesh).free, 0.3, seed=0)


def random_cube(seed: int, nodes: int = 10_000) -> Mesh:
    points, cells = cube(nodes, seed)
    return Mesh(points, _blocks(cells))


def of_file(name: str) -> Callable[[], Mesh]:
    return lambda: gmsnet.read(Path(os.environ["GMSNET_MESHES"], name))


USUAL: dict[str, Callable[[], Mesh]] = {
    **{f"random cube, seed {seed}": partial(random_cube, seed) for seed in range(5)},
    "jittered lattice": lambda: jittered(lattice_volume(17)),
    "part with two holes": lambda: jittered(part_volume(17)),
    **{name: of_file(name) for name in ("cub_wedge_like.vtk", "island.mesh", "cylinder_in_box.mesh")},
}
MESHES = {**USUAL, "random cube of 100,000 nodes": partial(random_cube, 0, 100_000)}


class Case:
    """A mesh as arrays in a file, and how a result is judged."""

    def __init__(self, mesh: Mesh, path: Path) -> None:
        topology = Volume.of(mesh)
        self.topology, self.path = topology, path
        used, rows = np.unique(topology.cells, return_inverse=True)
        cells = np.where(topology.orientation[:, None] > 0, topology.cells, topology.cells[:, [0, 2, 1, 3]])
        _, rows = np.unique(cells, return_inverse=True)
        self.cells, self.points = rows.reshape(cells.shape), mesh.points[used]
        free = np.zeros(len(mesh.points), dtype=bool)
        free[topology.free] = True
        self.held = ~free[used]
        self.own = ~self.held[self.cells].all(axis=1)
        np.savez(path, self.points, self.cells, outer_faces({"tetra": self.cells})["triangle"], self.held)

    def figures(self, points: np.ndarray) -> tuple[float, ...]:
        """Least and mean η, smallest and largest dihedral angle, inverted cells, and how far a held node has gone."""
        report = gmsnet.quality((points, [("tetra", self.cells)]))
        away = float(np.abs(points - self.points)[self.held].max())
        shape, low, high = report.shape[self.own], report.min_dihedral[self.own], report.max_dihedral[self.own]
        return shape.min(), shape.mean(), low.min(), high.max(), report.inverted, away

    def run(self, tool: str, limit: float) -> tuple[np.ndarray, float] | str:
        """What a tool makes of it, and its seconds; or why there is nothing."""
        return made_by(Path(__file__), tool, self.path, limit)


def line(name: str, figures: tuple[float, ...], seconds: float | None) -> str:
    least, mean, low, high, inverted, away = figures
    time = "" if seconds is None else f"{seconds:9.3f}"
    odd = f"  {int(inverted)} inverted" if inverted else ""
    odd += f"  moved held nodes by {away:.0e}" if away else ""
    return f"  {name:34}{least:9.4f}{mean:9.4f}{low:8.2f}{high:9.2f}{time}{odd}"


def run_mesh(name: str, case: Case, tools: list[str], repeats: int, limit: float) -> dict[str, Level]:
    """The table of one mesh: what each tool that did not fail came to."""
    print(f"\n{name}: {len(case.points):,} nodes, {(~case.held).sum():,} free, {len(case.cells):,} tetrahedra")
    print(f"  {'':34}{'least η':>9}{'mean':>9}{'angle':>8}{'largest':>9}{'seconds':>9}")
    print(line("input", case.figures(case.points), None), flush=True)
    ends: dict[str, np.ndarray] = {}
    least: dict[str, float] = {}
    failed: dict[str, str] = {}
    for turn in range(repeats):
        for tool in list(tools):
            if tool in failed or (turn and least[tool] > SLOW):
                continue
            found = case.run(tool, limit)
            if isinstance(found, str):
                failed[tool] = found
                continue
            ends[tool], seconds = found
            least[tool] = min(least.get(tool, np.inf), seconds)
            if turn == 0 and tool == "gmsnet":
                tools = [tool, f"gmsnet, {MORE * case.figures(ends[tool])[2]:.1f}°", *tools[1:]]
                case_target = case.run(tools[1], limit)
                if not isinstance(case_target, str):
                    ends[tools[1]], least[tools[1]] = case_target
    for tool in tools:
        if tool in failed:
            print(f"  {tool:34} {failed[tool]}", flush=True)
        elif tool in ends:
            print(line(tool, case.figures(ends[tool]), least[tool]), flush=True)
    return {tool: level(case, tool, ends[tool], least[tool]) for tool in tools if tool in ends and tool not in failed}


def level(case: Case, name: str, points: np.ndarray, seconds: float) -> Level:
    """As in peers/results.py."""
    least, mean, *_ = case.figures(points)
    return {"name": name, "seconds": seconds, "figures": {MIN: least, MEAN: mean}}


def early(case: Case, default: Level, goals: list[tuple[str, float]], limit: float) -> list[Level]:
    """Calls of gmsnet, the default among them, by their seconds: of each way until more sweeps can gain nothing.

    That is so when each of the goals is reached by a call that takes no longer.
    """
    found = [default]
    for way in WAYS:
        for sweeps in (0, *spread(MOST)):
            tool = f"{way}, {sweeps} sweeps"
            made = case.run(tool, limit)
            if isinstance(made, str):
                print(f"  {tool:34} {made}", flush=True)
                break
            print(line(tool, case.figures(made[0]), made[1]), flush=True)
            found = sorted([*found, level(case, tool, *made)], key=lambda each: each["seconds"])
            if all((there := level_to({"levels": found}, *goal)) and there["seconds"] <= made[1] for goal in goals):
                break
    return found


def print_times(case: Case, ends: dict[str, Level], limit: float) -> None:
    """How many times as fast gmsnet is to what each tool came to."""
    before, whole = level(case, "input", case.points, 0.0)["figures"], ends["gmsnet"]
    theirs = {tool: end for tool, end in ends.items() if not tool.startswith("gmsnet")}
    goals = [(key, end["figures"][key]) for end in theirs.values() for key in (MEAN, MIN)]
    ours = early(case, whole, [(key, value) for key, value in goals if value > before[key]], limit)
    none, one = (next(each for each in ours if each["name"].endswith(f", {count} sweeps")) for count in (0, 1))
    print(f"  gmsnet without a sweep {none['seconds']:.4f} s, with one {one['seconds']:.4f} s; times as fast:")
    print(f"  {'':34}{'whole':>7}  to its mean η, to its least η")
    for tool, end in theirs.items():
        shown = [f"{end['seconds'] / whole['seconds']:7.1f}"]
        for key in (MEAN, MIN):
            value = end["figures"][key]
            there = level_to({"levels": ours}, key, value) if value > before[key] else None
            most = f"({end['seconds'] / one['seconds']:.1f})"
            shown.append(f"{end['seconds'] / there['seconds']:.1f} {most} by {there['name']}" if there else f"– {most}")
        print(f"  {tool:34}{'   '.join(shown)}", flush=True)


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--meshes", nargs="+", choices=list(MESHES), default=list(USUAL), metavar="NAME")
    parser.add_argument("--tools", nargs="+", choices=list(TOOLS), default=list(TOOLS), metavar="NAME")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--limit", type=float, default=300.0, help="seconds after which a process is ended")
    parser.add_argument("--times", action="store_true", help="how many times as fast gmsnet comes to their results")
    parser.add_argument("--work", nargs=3, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.work:
        tool, source, target = options.work
        with np.load(source) as arrays:
            points, seconds = tool_named(tool)(*(arrays[f"arr_{k}"] for k in range(4)))
        np.savez(target, points=points, seconds=seconds)
        return
    print(describe())
    tools = [tool for tool in options.tools if MESQUITE in os.environ or not tool.startswith("Mesquite")]
    if len(tools) < len(options.tools):
        print(f"{MESQUITE} names no program: Mesquite is left out")
    with tempfile.TemporaryDirectory() as folder:
        for name in options.meshes:
            case = Case(MESHES[name](), Path(folder, "mesh.npz"))
            ends = run_mesh(name, case, tools, options.repeats, options.limit)
            if options.times:
                print_times(case, ends, options.limit)


if __name__ == "__main__":
    main()

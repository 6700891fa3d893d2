"""gmsnet.smooth beside other tools on quads and mixed meshes of the unit square, in one table.

    python benchmarks/quad_peers.py [--cells 1e4] [--kinds structured recombined mixed] [--seed 2] [--repeats 3]
        [--patience 20] [--limit 1800] [--peers NAME ...] [--folder build/quad_peers]

The meshes are those of quads.py; how tools are run and timed is told in peers/__init__.py: each in a process of its own
on one processor, the whole way from arrays to arrays, L beside each run. Tools: Gmsh Laplace2D and Relocate2D, MFEM's
TMOP with the metrics 2 and 58, whole-mesh L-BFGS on q², MeshKernel's orthogonalization, Mesquite's feasible Newton
(ShapeImprovementWrapper) and conjugate gradients (ShapeImprover). What to install: peers/requirements.txt.

For each tool: its final state, what that took, and how many times as fast gmsnet comes to 99 % of the tool's mean and
of its least 1/q (its own time to that, over ours; both in L). "–": the tool does not better the input, or gmsnet does
not come there. Behind each of the two: how many times as fast gmsnet would be if it came there in its first sweep.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from corners import Corners
from machine import describe
from peers.mixed import saved
from peers.results import MEAN, MIN, goal, level_to
from peers.runner import run_peer
from peers.table import OWN, QUAD_PEERS, named
from quads import KINDS, SMALL, made

TOOLS = (
    "Gmsh Laplace2D", "Gmsh Relocate2D", "MFEM TMOP 2", "MFEM TMOP 58", "L-BFGS on q²",
    *(peer.name for peer in QUAD_PEERS),
)  # fmt: skip


def times(theirs, ours, key, before):
    """How many times as fast ours comes to 99 % of the tool's final figure, and would with its first sweep; None where
    either does not come there."""
    wanted = goal(theirs, key, before)
    if wanted is None or before[key] >= wanted:
        return None, None
    its, mine = level_to(theirs, key, wanted), level_to(ours, key, wanted)
    levels = mine, its and ours["levels"][0]
    return tuple(its["units"] / level["units"] if its and level else None for level in levels)


def line(name, record, ours, before):
    if record["status"] != "measured":
        return f"  {name:18} {record['status']}: {record['reason']}"
    last = record["levels"][-1]
    figures = last["figures"]
    text = (f"  {name:18} {figures[MIN]:8.4f} {figures[MEAN]:7.4f} {figures['invalid']:5}  {last['seconds']:8.3f}"
            f" {last['units']:9.1f}  {last['boundary_shift']:8.0e}")  # fmt: skip
    if record is ours or ours["status"] != "measured":
        return text
    ratios = [ratio for key in (MEAN, MIN) for ratio in times(record, ours, key, before)]
    end = ours["levels"][-1]["figures"]
    better = [end[key] > figures[key] for key in (MEAN, MIN)]
    shown = "  ".join(f"{'–' if ratio is None else f'{ratio:.1f}':>7}" for ratio in ratios)
    return f"{text}  {shown}  {'  '.join(f'{each!s:>6}' for each in better)}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cells", type=float, default=1e4)
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS))
    parser.add_argument("--seed", type=int, default=2)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--patience", type=float, default=20.0, help="seconds after which an effort is not repeated")
    parser.add_argument("--limit", type=float, default=1800.0, help="seconds after which a process is ended")
    parser.add_argument("--peers", nargs="+", default=list(TOOLS), metavar="NAME")
    parser.add_argument("--folder", type=Path, default=Path("build/quad_peers"))
    options = parser.parse_args()
    print(describe())
    document = {"machine": describe(), "meshes": {}}
    for kind in options.kinds:
        mesh = made(kind, int(options.cells), options.seed)
        paths = [
            saved(each, options.folder / f"{kind}-{name}.npz").resolve()
            for name, each in (("mesh", mesh), ("small", made(kind, SMALL, options.seed)))
        ]
        before = Corners.of(mesh).figures(mesh.points)
        found = {
            name: run_peer(named(name), *paths, len(mesh.points), vars(options), "peers.mixed")
            for name in (OWN[0].name, *options.peers)
        }
        ours = found[OWN[0].name]
        unit = f", L {1e9 * ours['L'] / ours['free']:.1f} ns a free node" if "L" in ours else ""
        print(f"\n{kind}, {len(mesh.points):,} nodes{unit}: least 1/q {before[MIN]:.4f}, mean {before[MEAN]:.4f}")
        print(f"  {'':18}  min 1/q    mean invalid   seconds         L  boundary  times (at most): mean, least  better")
        for name, record in found.items():
            print(line(name, record, ours, before), flush=True)
        document["meshes"][kind] = {"input": before, "tools": found}
        text = json.dumps(document, indent=1, ensure_ascii=False) + "\n"
        (options.folder / "results.json").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()

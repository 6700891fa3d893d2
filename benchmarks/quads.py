"""Is gmsnet.smooth as good as converged optimisation on quads and mixed meshes, and in what time?

    python benchmarks/quads.py [--cells 1e4] [--seeds 0 1 2 3 4] [--kinds structured recombined mixed] [--repeats 3]
        [--ceilings benchmarks/quad_ceilings.json] [--refresh] [--json FILE]

Three kinds of meshes of about so many cells:
- structured: rows and columns of quads, inner nodes thrown by up to 0.4 of their shortest edge, kept valid.
- recombined: quads of a random triangulation whose triangles were joined to quads, and all cells split into quads.
- mixed: seeds 0 and 1 a random triangulation whose triangles were joined to quads where they have a partner; the others
  a patch of rows and columns in random triangles, inner nodes thrown as above.

With the defaults of ``gmsnet.smooth`` each must come to a least 1/q of at least that of whole-mesh L-BFGS on the mean
of q, q² and q⁴ over the corner simplices (reference.py), and to a mean over the cells with a free node of at most 0.005
less, without an invalid cell. The references are read from a file, and computed and kept there where it has none.
--refresh: computes them anew.

Time is that of the whole call on one thread, from mesh to result, after a call on a small mesh of the same kind. L is
one product of SciPy's sparse matrix that averages, for each free node, the nodes that share an edge with it, with the
coordinates, nodes in reverse Cuthill–McKee order: 20 of them in a row, over 20. Both are seconds of the processor, and
take turns; medians count. At 100,000 nodes at most 60 L are allowed.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path
from statistics import median

import numpy as np
from corners import Corners
from machine import describe
from reference import POWERS, quad_ceiling

import gmsnet
from gmsnet.generate import disturb, hybrid_mesh, random_quad_mesh, structured_mesh

KINDS = ("structured", "recombined", "mixed")
THROW = 0.4  # of the shortest edge at the node
LESS_MEAN, ROUNDING = 0.005, 1e-9
NODES_OF_CELL = {"mixed": 1 / 1.2, "patch": 1 / 1.5}  # inner nodes for each cell, of those two kinds of mixed meshes
ROW_OF_L = 20
SMALL = 400  # cells of the mesh to warm up with


def made(kind, cells, seed):
    """A mesh of the benchmark."""
    if kind == "structured":
        return thrown(structured_mesh(round(cells**0.5)), seed)
    if kind == "recombined":
        return random_quad_mesh(cells, seed=seed)
    if seed < 2:
        return random_quad_mesh(round(cells * NODES_OF_CELL["mixed"]), cells="mixed", seed=seed)
    return thrown(hybrid_mesh(round(cells * NODES_OF_CELL["patch"]), seed=seed), seed)


def thrown(mesh, seed):
    return disturb(mesh, Corners.of(mesh).problem.free, THROW, seed=seed, edge="shortest")


def checks(found, reference):
    """Name → whether a mesh with these figures passes."""
    return {
        "min 1/q ≥ reference": found["min"] >= reference["min"] - ROUNDING,
        f"mean ≥ reference − {LESS_MEAN}": found["mean"] >= reference["mean"] - LESS_MEAN,
        "0 invalid": found["invalid"] == 0,
    }


def reference_of(mesh):
    """What ``quad_ceiling`` makes of a mesh, beside the mesh itself."""
    began = time.perf_counter()
    _, figures = quad_ceiling(mesh)
    seconds = time.perf_counter() - began
    cells = sum(len(block.nodes) for block in mesh.cells if block.dimension == 2)
    return {"cells": cells, "input": Corners.of(mesh).figures(mesh.points), "reference": figures, "seconds": seconds}


def stored(path, wanted, refresh):
    """ "kind/cells/seed" → ``reference_of``; what the file does not have is computed and added to it at once."""
    document = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    found = document.setdefault("meshes", {})
    for name in wanted:
        if name in found and not refresh:
            continue
        kind, cells, seed = name.split("/")
        found[name] = reference_of(made(kind, int(cells), int(seed)))
        document |= {"machine": describe(), "powers": list(POWERS)}
        path.write_text(json.dumps(document, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
        print(f"reference of {name}: {found[name]['seconds']:.1f} s", flush=True)
    return found


def study(mesh, reference, repeats):
    """The figures of ``gmsnet.smooth`` with its defaults, and its time in L."""
    corners = Corners.of(mesh)
    matrix, points = corners.averaging, np.ascontiguousarray(corners.mesh.points[corners.order])
    calls, products = [], []
    for _ in range(repeats):
        began = time.process_time()
        result = gmsnet.smooth(mesh, threads=1)
        calls.append(time.process_time() - began)
        began, at = time.process_time(), points
        for _ in range(ROW_OF_L):
            at = matrix @ at
        products.append((time.process_time() - began) / ROW_OF_L)
    found, free = corners.figures(result.points), int(corners.problem.free.sum())
    return {
        "found": found,
        "passed": checks(found, reference),
        "sweeps": result.sweeps,
        "free": free,
        "seconds": median(calls),
        "L_ns": 1e9 * median(products) / free,
        "in_L": median(calls) / median(products),
    }


def table(rows, references):
    columns = "   ".join(f"{name:>7} {'found':>7} {'L-BFGS':>7}" for name in ("min 1/q", "mean"))
    print(f"\n  {'':22} {'cells':>7}  {columns}      L  ns of L")
    for name, row in rows.items():
        before, reference, found = references[name]["input"], references[name]["reference"], row["found"]
        figures = "   ".join(f"{before[k]:7.4f} {found[k]:7.4f} {reference[k]:7.4f}" for k in ("min", "mean"))
        missed = [check for check, passed in row["passed"].items() if not passed]
        print(f"  {name:22} {references[name]['cells']:7,}  {figures}  {row['in_L']:5.1f}    {row['L_ns']:5.1f}  "
              f"{'pass' if not missed else 'FAIL: ' + ', '.join(missed)}")  # fmt: skip


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cells", type=float, default=1e4)
    parser.add_argument("--seeds", nargs="+", type=int, default=[0, 1, 2, 3, 4])
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS))
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--ceilings", type=Path, default=Path(__file__).with_name("quad_ceilings.json"))
    parser.add_argument("--refresh", action="store_true")
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    print(describe())
    wanted = [f"{kind}/{int(options.cells)}/{seed}" for kind in options.kinds for seed in options.seeds]
    references = stored(options.ceilings, wanted, options.refresh)
    rows = {}
    for name in wanted:
        kind, cells, seed = name.split("/")
        gmsnet.smooth(made(kind, SMALL, int(seed)), threads=1)
        mesh = made(kind, int(cells), int(seed))
        rows[name] = study(mesh, references[name]["reference"], options.repeats)
    table(rows, references)
    good = sum(all(row["passed"].values()) for row in rows.values())
    print(f"\n{good} of {len(rows)} pass; one thread, medians of {options.repeats}")
    if options.json:
        document = {"machine": describe(), "meshes": rows}
        options.json.write_text(json.dumps(document, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    return 0 if good == len(rows) else 1


if __name__ == "__main__":
    sys.exit(main())

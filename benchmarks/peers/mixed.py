"""Quads and mixed meshes of the unit square: as tools get them, and one tool on one of them in a process of its own.

python -m peers.mixed JOB.json RESULT.json, in the folder benchmarks. The job is that of worker.py. The figures are
those of corners.py: 1/q of a quad is that of its worst corner, the mean is over the cells with a free node.
"""

from __future__ import annotations

from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from gmsnet import CellBlock, Mesh
from peers.peer import Peer, Plane


def mesh_of(plane: Plane) -> Mesh:
    """The triangles and quads of one region."""
    kinds = {"quad": plane.quads, "triangle": plane.cells}
    blocks = [CellBlock(kind, nodes, np.ones(len(nodes), dtype=int)) for kind, nodes in kinds.items() if len(nodes)]
    return Mesh(plane.points, tuple(blocks))


def saved(mesh: Mesh, path: Path) -> Path:
    """The file with the arrays of a mesh whose faces are triangles and quads, counter-clockwise."""
    arrays = {kind: np.empty((0, size), dtype=np.int64) for kind, size in (("triangle", 3), ("quad", 4))}
    arrays |= {block.kind: block.nodes for block in mesh.cells if block.dimension == 2}
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez(path, points=mesh.points, cells=arrays["triangle"], quads=arrays["quad"])
    return path


def measured(job: dict[str, Any]) -> dict[str, Any]:
    """What the tool of the job does on its mesh, and how long it takes, with each of its efforts."""
    from corners import Corners

    from peers.table import named
    from peers.worker import Unit, fresh, run, tool_of

    peer: Peer = named(job["peer"])
    plane = Plane.load(job["mesh"])
    corners, unit = Corners.of(mesh_of(plane)), Unit(plane)
    run(peer, Plane.load(job["small"]), max(peer.efforts, default=100))
    efforts = peer.efforts or tool_of(peer)(plane, **peer.options).efforts()
    levels = []
    for effort in efforts:
        runs, units = [], []
        while len(runs) < job["repeats"] and sum(each.clock for each in runs) < job["patience"]:
            units.append(unit.seconds())
            runs.append(run(peer, fresh(plane), effort))
        seconds = [sum(each.seconds) for each in runs]
        points, held = np.asarray(runs[-1].points)[:, :2], ~corners.problem.free
        levels.append({
            "effort": effort, "runs": len(runs), "seconds": median(seconds),
            "units": median(one / other for one, other in zip(seconds, units, strict=True)),
            "smoothing": median(each.seconds[1] for each in runs),
            "figures": corners.figures(np.ascontiguousarray(points, dtype=np.float64)),
            "boundary_shift": float(np.abs(points[held] - plane.points[held]).max()),
        })  # fmt: skip
    return {"free": int(corners.problem.free.sum()), "L": median(units), "levels": levels}


if __name__ == "__main__":
    from peers.worker import answer

    answer(measured)

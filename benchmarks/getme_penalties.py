"""Whether the paper's GETMe lowered the penalty of an element that was transformed, or raised it: its rows of Table 2.

    python benchmarks/getme_penalties.py [RUNS]

The book lowers it, and so does the method "getme". Sequential GETMe in plain Python with the paper's parameters on the
four cases, at most 100 steps for each free node, tested every 100 steps, stopped after 20 tests in which q̂ (with 1/q_V)
gained nothing, or never stopped ("to end"); the means over the runs (default 10), which take some minutes.
"""

from __future__ import annotations

import sys

import numpy as np

from gmsnet.measure.report import QualityReport, measure
from gmsnet.mesh.mesh import Mesh
from gmsnet.paper import printed
from gmsnet.paper.cases import CASES
from gmsnet.paper.plain import PlainMesh
from gmsnet.paper.plain_getme import SUCCESS, PlainGetme
from gmsnet.topology.topology import Topology

PERIOD, PATIENCE, SWEEPS = 100, 20, 100
READINGS = {  # what a transformation takes off a penalty, and after how many tests without gain a run stops
    "lowered": (SUCCESS, PATIENCE),
    "lowered, to end": (SUCCESS, None),
    "raised": (-SUCCESS, PATIENCE),
    "raised, to end": (-SUCCESS, None),
}


def smoothed(mesh: Mesh, success: float, patience: int | None) -> QualityReport:
    """The best mesh on the way."""
    topology = Topology.of(mesh)
    getme = PlainGetme(PlainMesh.of(mesh, topology), success=success)
    best, without_gain = measure(mesh, topology), 0
    for _ in range(SWEEPS * len(topology.free) // PERIOD):
        for _ in range(PERIOD):
            getme.step()
        points = mesh.points.copy()
        points[:, mesh.plane or (0, 1)] = getme.mesh.array()
        report = measure(mesh.with_points(points), topology)
        gain = report.qhat_aspect > best.qhat_aspect
        best, without_gain = (report, 0) if gain else (best, without_gain + 1)
        if without_gain == patience:
            break
    return best


def row(report: QualityReport) -> np.ndarray:
    """(6,) the columns of the table."""
    low, high, aspect = report.min_angle, report.max_angle, report.aspect
    return np.array([low.min(), low.mean(), high.max(), high.mean(), aspect.min(), aspect.mean()])


def main() -> None:
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    for name, case in CASES.items():
        print(name)
        paper = np.array(list(printed.table2()[name, "GETMeSmoothing"].values.values()))
        print(f"  {'the paper':16}", *(f"{value:8.3f}" for value in paper))
        for title, reading in READINGS.items():
            rows = [row(smoothed(case.mesh(run), *reading)) for run in range(runs)]
            print(f"  {title:16}", *(f"{value:8.3f}" for value in np.mean(rows, axis=0)), flush=True)


if __name__ == "__main__":
    main()

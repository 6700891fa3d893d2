"""What ``smooth`` returns."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.measure.bounds.bounds import Limits, limits
from gmsnet.measure.report import QualityReport
from gmsnet.mesh.adapters import to_mesh
from gmsnet.run.sweep import Sweep as Sweep
from gmsnet.run.untangle_stage import StillInvertedCell
from gmsnet.topology.topology import Topology

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SmoothResult:
    """What ``smooth`` returns.

    mesh: of the type that came in. points: (N, dim) float64. before, after: QualityReports. sweeps: how many were
    made. stop_reason: one of the texts above. moved: (N,) bool, which nodes are elsewhere than in the input.
    held: reason → ids of the nodes that were not free. history: one Sweep for each look. notes: what else there is to
    know, a sentence each. unmended: the cells that untangling could not mend and that are inverted still, and why.
    topology: what follows from the connectivity, with the nodes that were held.
    seconds: for the whole call.
    """

    mesh: Any
    points: Floats
    before: QualityReport
    after: QualityReport
    sweeps: int
    stop_reason: str
    moved: NDArray[np.bool_]
    held: dict[str, NDArray[np.int64]]
    history: list[Sweep]
    notes: list[str]
    unmended: list[StillInvertedCell]
    topology: Topology
    seconds: float

    @cached_property
    def limits(self) -> Limits:
        """Upper bounds of the worst cells with this connectivity and these held nodes; made when first asked for."""
        return limits(to_mesh(self.mesh)[0], self.topology)

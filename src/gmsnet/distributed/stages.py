"""The stages of a serial run that ranks have in common: sweeps, and in space those for angles and the mean."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple, cast

import numpy as np

from gmsnet.distributed.executor import Ranks
from gmsnet.distributed.mending import Mended
from gmsnet.distributed.part import Part
from gmsnet.measure.report import QualityReport
from gmsnet.methods import Smoother
from gmsnet.preserve.protection import Protection
from gmsnet.run.options import SmoothOptions
from gmsnet.run.stages import carry_out_all
from gmsnet.run.state import State
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume


class _Input(NamedTuple):
    """As much of the input's QualityReport as these stages look at."""

    inverted: int


def swept(
    part: Part, topology: Topology | Volume, smoother: Smoother, options: SmoothOptions, executor: Ranks,
    mended: Mended | None,
) -> State:  # fmt: skip
    """The state after them, points in memory order. topology: of ``Part.ready``. mended: where some were inverted."""
    nothing, before = np.empty(0, dtype=np.float32), cast(QualityReport, _Input(0 if mended is None else mended.cells))
    state = State(
        part.mesh, lambda points: points, smoother, before, Protection(topology, []), part.points, part.points, nothing
    )
    if mended is not None:
        state = replace(state, points=mended.points, untangled=mended.points)
    return carry_out_all(state, options, executor)

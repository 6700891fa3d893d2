"""A finished run: the mesh, its figures before and after, and what there is to know."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.measure.bounds.bounds import Limits, limits
from gmsnet.measure.judged import UNKNOWN, Judged
from gmsnet.measure.report import QualityReport
from gmsnet.measure.surface_change import Compared, SurfaceChange, surface_change
from gmsnet.mesh.adapters import to_mesh
from gmsnet.mesh.display import amount, html_table, plain, text_table
from gmsnet.metric.conformity import ConformityChange
from gmsnet.run.sweep import Sweep as Sweep
from gmsnet.run.untangle_stage import StillInvertedCell
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume

Floats = NDArray[np.float64]


class HeldNodes(dict[str, NDArray[np.int64]]):
    """Reason → ids of the nodes that are held for it. It shows how many they are."""

    def __repr__(self) -> str:
        """Reason → count."""
        counts = (f"{reason!r}: {amount(len(ids), 'node')}" for reason, ids in self.items())
        return f"{{{', '.join(counts)}}}"


@dataclass(frozen=True, eq=False)
class Result:
    """A finished run. The fields are those of ``SmoothResult``, which tells what they are."""

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
    topology: Topology | Volume
    seconds: float
    invalid_curved: int = 0
    conformity: ConformityChange | None = None
    asked: Mapping[str, Any] = field(default_factory=dict)
    compared: Compared | None = None
    judged: Judged = UNKNOWN

    def __post_init__(self) -> None:
        object.__setattr__(self, "held", HeldNodes(self.held))

    def __repr__(self) -> str:
        """What was done, the most telling figures before and after, and what there is to know: one screen."""
        return "\n".join([f"{type(self).__name__}: {self._done}", text_table(self._figures), *self._remarks])

    def _repr_html_(self) -> str:
        """The same for a notebook."""
        return html_table(f"{type(self).__name__}: {self._done}", self._figures, self._remarks)

    @property
    def _done(self) -> str:
        moved = f"{np.count_nonzero(self.moved):,} of {amount(free_nodes(self), 'free node')} moved"
        return f"{moved}, {amount(self.sweeps, 'sweep')} in {plain(self.seconds)} s, {self.stop_reason}"

    @property
    def _figures(self) -> list[tuple[str, ...]]:
        pairs = [*zip(self.before.figures(), self.after.figures(), strict=True)]
        if self.conformity is not None:
            pairs += zip(*(each.figures() for each in self.conformity), strict=True)
        return [("", "before", "after"), *((*before, after) for before, (_, after) in pairs)]

    @property
    def _remarks(self) -> list[str]:
        reasons = ", ".join(f"{reason} {len(ids):,}" for reason, ids in self.held.items())
        inverted = f"inverted still: {amount(len(self.unmended), 'cell')}, see unmended"
        return [*([f"held: {reasons}"] if reasons else []), *([inverted] if self.unmended else []), *self.notes]

    @cached_property
    def surface_change(self) -> SurfaceChange | None:
        """How far the surface has come from the input's facets; None where there is no surface that changes."""
        return None if self.compared is None else surface_change(self.compared)

    @cached_property
    def limits(self) -> Limits:
        """Upper bounds of the worst cells with this connectivity and these held nodes; made when first asked for."""
        return limits(to_mesh(self.mesh)[0], self.topology, report=self.after)


def free_nodes(result: Result) -> int:
    """How many nodes could move, those among them that were held once they were untangled."""
    still = np.zeros(len(result.points), dtype=bool)
    for ids in result.held.values():
        still[ids] = True
    return int(np.count_nonzero(~still | result.moved))

"""What ``smooth`` returns."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

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

if TYPE_CHECKING:
    from gmsnet.mesh.mesh import Mesh
    from gmsnet.run.account import Account

Floats = NDArray[np.float64]


class HeldNodes(dict[str, NDArray[np.int64]]):
    """Reason → ids of the nodes that are held for it. It shows how many they are."""

    def __repr__(self) -> str:
        """Reason → count."""
        counts = (f"{reason!r}: {amount(len(ids), 'node')}" for reason, ids in self.items())
        return f"{{{', '.join(counts)}}}"


@dataclass(frozen=True, eq=False)
class SmoothResult:
    """What ``smooth`` returns.

    mesh: of the type that came in. points: (N, dim) float64. before, after: QualityReports. sweeps: how many were
    made. stop_reason: one of the texts above. moved: (N,) bool, which nodes are elsewhere than in the input.
    held: reason → ids of the nodes that were not free. history: one Sweep for each look. notes: what else there is to
    know, a sentence each. unmended: the cells that untangling could not mend and that are inverted still, and why.
    topology: what follows from the connectivity, with the nodes that were held.
    seconds: for the whole call. invalid_curved: how many second-order cells are not certified valid. conformity: before
    and after, to the metric or the sizes that were asked for; None without any. With one, the least and the mean 1/q in
    ``history`` are those in the metric. asked: the options of the call that were not the defaults, as plain values.
    compared: the surface whose nodes may have slid, before and after (``surface_change``); None where none does.
    judged: means and extremes over the cells with a free node, by which meshes are compared, before and after.
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

    def report(self, path: str | os.PathLike[str]) -> None:
        """Write one HTML file that shows what was done: figures, a picture before and after, what is held and why.

        It needs nothing but a browser, and loads nothing. path: ``.html``. Raises InputError for another suffix, and
        where the file cannot be written.
        """
        from gmsnet.page import write_page
        from gmsnet.run.reporting import contents_of

        given = "".join(f", {name}={value!r}" for name, value in self.asked.items())
        mesh = to_mesh(self.mesh)[0]
        write_page(path, contents_of(self._account(mesh), "mesh", f"gmsnet.{self._function}(mesh{given})"))

    _function = "smooth"  # that returned it

    def _account(self, mesh: Mesh) -> Account:
        from gmsnet.run.account import Account

        return Account(mesh, self)

    @cached_property
    def limits(self) -> Limits:
        """Upper bounds of the worst cells with this connectivity and these held nodes; made when first asked for."""
        return limits(to_mesh(self.mesh)[0], self.topology, report=self.after)


def free_nodes(result: SmoothResult) -> int:
    """How many nodes could move, those among them that were held once they were untangled."""
    still = np.zeros(len(result.points), dtype=bool)
    for ids in result.held.values():
        still[ids] = True
    return int(np.count_nonzero(~still | result.moved))

"""What ``smooth`` returns."""

from __future__ import annotations

import os

from gmsnet.mesh.adapters import to_mesh
from gmsnet.mesh.mesh import Mesh
from gmsnet.run.account import Account
from gmsnet.run.result import Result


class SmoothResult(Result):
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

    _function = "smooth"  # that returned it

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

    def _account(self, mesh: Mesh) -> Account:
        return Account(mesh, self)

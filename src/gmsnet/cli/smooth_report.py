"""What ``gmsnet smooth`` says about what it did, as text and as JSON."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import Any

from gmsnet.cli import output
from gmsnet.cli import report as tables
from gmsnet.cli.destination import shown
from gmsnet.mesh.display import amount
from gmsnet.mesh.known_cells import counts
from gmsnet.mesh.mesh import Mesh
from gmsnet.run.account import Account
from gmsnet.topology.held import ON_BOUNDARY, ON_INTERFACE


@dataclass(frozen=True, eq=False)
class Outcome(Account):
    """A finished run on a file.

    written: the file that was written, None where there was no need to. lost: by conversion. plot, report: files with a
    picture and with a report, where they were asked for.
    """

    input: str = ""
    written: str | None = None
    lost: list[str] = field(default_factory=list)
    plot: str | None = None
    report: str | None = None

    def print(self, aside: bool) -> None:
        """The tables; ``aside``: on standard error, because the mesh itself went to the standard output."""
        result, console = self.result, output.console(stderr=aside)
        moved = result.moved.any()
        console.print(f"{shown(self.input)}: {counts(self.mesh)}")
        if len(result.after.cell):
            console.print()
            console.print(tables.figures({"before": result.before, "after": result.after}))
            if result.conformity is not None:
                console.print(tables.conformity(result.conformity))
            console.print(f"\nworst cells{' now' if moved else ''} (numbers from 0)")
            console.print(tables.worst_table(self.worst))
            console.print()
        if stages := self.stage_rows():
            console.print(output.table(stages[0], stages[1:]))
            console.print()
        console.print(self.verdict())
        for note in [*self.surface(), *self.result.notes]:
            console.print(note)
        if len(result.after.cell) and self.free:
            console.print(self.nearness())
        held = len(self.mesh.points) - self.free
        if held and self.free:
            console.print(f"held: {held:,} of {amount(len(self.mesh.points), 'node')} ({self.reasons()})")
            may_slide = not _has_second_order(self.mesh) and not any("slide:" in note for note in result.notes)
            if may_slide and len(result.held.get(ON_BOUNDARY, ())) > self.free:
                console.print("most nodes are at the boundary and stay there: --slide all lets them move along it")
            if ON_INTERFACE in result.held:
                console.print(
                    "nodes between regions stay there: --join-regions lets those move that are of no marker, "
                    "if regions mean nothing"
                )
        if self.written is None:
            console.print(f"left as it is: {self.input}")
        elif not aside:
            console.print(f"written{'' if moved else ' unchanged'}: {self.written}")
        for loss in self.lost:
            console.print(f"lost in conversion: {loss}")
        if self.plot is not None:
            console.print(f"picture: {self.plot}")
        if self.report is not None:
            console.print(f"report: {self.report}")

    def write_report(self, path: str, command: str) -> None:
        """The page."""
        from gmsnet.page import write_page
        from gmsnet.run.reporting import contents_of

        facts = [("read", shown(self.input)), ("written", self.written or "nothing: the input is left as it is")]
        facts += [("lost in conversion", loss) for loss in self.lost]
        write_page(path, contents_of(self, os.path.basename(shown(self.input)), command, facts))

    def print_line(self, number: str) -> None:
        """What matters most, in one line."""
        before, after = self.result.before, self.result.after
        gain = "no cells to measure"
        if before.totals is not None and after.totals is not None:
            pairs = [(before.shape.min(), after.shape.min()), (before.shape.mean(), after.shape.mean())]
            least, mean = (f"{one:.4f} → {other:.4f}" for one, other in pairs)
            gain = f"{after.symbol} least {least}, mean {mean}"
        written = "not written" if self.written is None else self.written
        output.console().print(f"{number}{shown(self.input)}: {gain}; {self.verdict()}; {written}")

    def print_json(self, *, line: bool = False) -> None:
        """The whole outcome as one document."""
        output.print_json(self.document(), line=line)

    def document(self) -> dict[str, Any]:
        """The whole outcome as plain values."""
        files = {"input": self.input, "output": self.written, "plot": self.plot, "report": self.report}
        return {**files, **super().document(), "lost": self.lost}


def _has_second_order(mesh: Mesh) -> bool:
    """Are some faces or volumes of second order? The nodes of their boundaries do not slide."""
    return any((block.dimension or 0) > 1 and block.cell.order > 1 and len(block.nodes) for block in mesh.cells)

"""A finished run as the contents of a page."""

from __future__ import annotations

from collections.abc import Sequence

from gmsnet.measure.worst import worst_cells
from gmsnet.mesh.known_cells import unmeasured
from gmsnet.page import Contents, Grid
from gmsnet.run.account import Account

WORST = 10  # cells are listed, before and after


def contents_of(account: Account, title: str, command: str, facts: Sequence[tuple[str, str]] = ()) -> Contents:
    """What a page tells of a run. title: most often the name of the file. facts: what else there is, (term, text)."""
    result = account.result
    known, measured = [*facts], len(result.after.cell)
    if account.target:
        known.append(("target", account.target.words(result.after.symbol)))
    if measured and account.free:
        known.append(("nearness", account.nearness()))
    if others := unmeasured(account.mesh):
        known.append(("not measured", others))
    grids = []
    if result.conformity is not None:
        grids.append(Grid("Conformity to the metric", [["", "before", "after"], *result.conformity.rows()]))
    if stages := account.stage_rows():
        grids.append(Grid("Stages", stages))
    return Contents(
        title=title, verdict=account.verdict(), mesh=account.mesh, before=result.before, after=result.after,
        document=account.document(), command=command, faults=account.faults(), held=result.held,
        notes=[*account.surface(), *result.notes],
        worst_before=worst_cells(account.mesh, result.before, account.held, WORST),
        worst_after=worst_cells(account.mesh, result.after, account.held, WORST),
        unmended=[(cell.cell, cell.reason) for cell in result.unmended], facts=known, grids=grids,
    )  # fmt: skip

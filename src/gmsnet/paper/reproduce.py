"""The paper's tables and figures, made anew: the work, and the page, tables and document that come of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from gmsnet import plot
from gmsnet.errors import InputError
from gmsnet.paper import parts
from gmsnet.paper.document import collect
from gmsnet.paper.page import page
from gmsnet.paper.plan import WHAT, Plan
from gmsnet.paper.sheets import sheets
from gmsnet.paper.store import Store, dumps
from gmsnet.paper.units import UnitsDone, carry_out, missing

PAGE, DOCUMENT = "reproduction.html", "reproduction.json"


@dataclass(frozen=True)
class Work:
    """A reproduction that is ready to be carried out. there, total: how many of its units are there already."""

    what: str
    plan: Plan
    store: Store
    there: int
    total: int

    @property
    def wanted(self) -> tuple[str, ...]:
        """The parts that were asked for."""
        return parts.PARTS if self.what == "all" else (self.what,)


def prepare(what: str, plan: Plan, folder: Path) -> Work:
    """Checks all that can be checked before the work, and claims the folder.

    Raises InputError for an unknown part and where the folder cannot be used; MissingExtraError where a library is not
    installed.
    """
    if what not in WHAT:
        raise InputError(f"there is no {what!r} to reproduce; choose one of: {', '.join(WHAT)}")
    plot.check_target(f"{DOCUMENT}.png")
    store = Store(folder)
    store.open(plan.fingerprint())
    batches = parts.batches(plan, parts.PARTS if what == "all" else (what,))
    total, left = (sum(len(batch.units) for batch in those) for those in (batches, missing(batches, store)))
    return Work(what, plan, store, total - left, total)


def reproduce(
    work: Work, on_unit: Callable[[UnitsDone], None], should_stop: Callable[[], bool]
) -> list[Path] | None:  # fmt: skip
    """Does what is not there yet, and writes page, tables and document of all parts that are; returns their paths.

    None if it was stopped; what is done is kept, and the same call goes on from there. See ``units.carry_out``.
    """
    if not carry_out(parts.batches(work.plan, work.wanted), work.plan, work.store, on_unit, should_stop):
        return None
    document = collect(work.plan, work.store, parts.complete(work.plan, work.store))
    pictures = {each["file"]: (work.store.folder / each["file"]).read_bytes() for each in document.get("figures", [])}
    written = {PAGE: page(document, pictures), DOCUMENT: dumps(document), **sheets(document)}
    work.store.write(written)
    return [work.store.folder / name for name in written]

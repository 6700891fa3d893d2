"""``gmsnet methods``: which smoothers there are."""

from __future__ import annotations

from typing import Annotated

import typer


def methods(
    json: Annotated[bool, typer.Option("--json", help="Print one JSON document.")] = False,
) -> None:
    """List the smoothing methods."""
    from gmsnet.cli import output
    from gmsnet.methods import METHODS

    if json:
        rows = [{"name": each.name, "summary": each.summary, "source": each.source} for each in METHODS.values()]
        output.print_json({"methods": rows})
        return
    console = output.console()
    for each in METHODS.values():
        console.print(each.name, style="bold")
        console.print(f"    {each.summary}")
        console.print(f"    {each.source}")

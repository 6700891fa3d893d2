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
        keys = ("name", "summary", "source", "variants", "objectives", "weighted")
        output.print_json({"methods": [{key: getattr(each, key) for key in keys} for each in METHODS.values()]})
        return
    console = output.console()
    for each in METHODS.values():
        console.print(each.name, style="bold")
        console.print(f"    {each.summary}")
        for kind, names in (("variants", each.variants), ("objectives", each.objectives)):
            if names:
                console.print(f"    {kind} (the first is the default): {', '.join(names)}")
        console.print(f"    {each.source}")

"""``gmsnet methods``: which smoothers there are."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from gmsnet.methods import Method


def methods(
    json: Annotated[bool, typer.Option("--json", help="Print one JSON document.")] = False,
) -> None:
    """List the smoothing methods."""
    from gmsnet.cli import output
    from gmsnet.methods import METHODS

    if json:
        keys = ("name", "summary", "source", "variants", "objectives", "weighted", "cells", "limits")
        output.print_json({"methods": [{key: getattr(each, key) for key in keys} for each in METHODS.values()]})
        return
    console = output.console()
    for each in METHODS.values():
        console.print(each.name, style="bold")
        console.print(f"    {each.summary}")
        for kind, names in (("variants", each.variants), ("objectives", each.objectives)):
            if names:
                console.print(f"    {kind} (the first is the default): {', '.join(names)}")
        console.print(f"    moves the nodes of: {moved(each)}")
        console.print(f"    {each.source}")


def moved(method: Method) -> str:
    """The kinds of cells, and what is different with some objectives."""
    text = " and ".join(f"{kind}s" for kind in method.cells)
    for objective, kinds in method.limits.items():
        text += f"; with {objective}: {' and '.join(f'{kind}s' for kind in kinds)}"
    return text

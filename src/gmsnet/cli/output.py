"""How the command line speaks: tables and text that survive pipes and plain terminals, and strict JSON."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping, Sequence
from typing import Any

from rich import box
from rich.console import Console
from rich.table import Table

from gmsnet.mesh.display import strict, visible

PIPE_WIDTH = 1000  # where nobody looks, nothing is wrapped
TABLE_WIDTH = 100  # a narrower terminal wraps the lines itself: better than figures cut short


class _Console(Console):
    """A console that leaves it to ``main`` to notice that nobody reads any more."""

    def print(self, *things: Any, **options: Any) -> None:
        """As of any console; text of files and names of files give the terminal no commands."""
        super().print(*(visible(thing) if isinstance(thing, str) else thing for thing in things), **options)

    def on_broken_pipe(self) -> None:
        """Rich calls this while it handles the BrokenPipeError, which goes on from here."""
        raise


def console(stderr: bool = False) -> Console:
    """Where text goes. Names of files may hold brackets and colons, so no markup is read in them."""
    terminal = (sys.stderr if stderr else sys.stdout).isatty()
    made = _Console(stderr=stderr, markup=False, highlight=False, emoji=False, soft_wrap=True)
    made.width = max(made.width, TABLE_WIDTH) if terminal else PIPE_WIDTH
    return made


def table(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> Table:
    """A table with its first column to the left and the others, figures, to the right."""
    made = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False, header_style="bold")
    for index, name in enumerate(columns):
        made.add_column(name, justify="left" if index == 0 else "right", no_wrap=index > 0)
    for row in rows:
        made.add_row(*row)
    return made


def print_json(document: Mapping[str, Any], *, line: bool = False) -> None:
    """A JSON document on the standard output, on one line if asked for; what is not a finite number is null."""
    sys.stdout.write(json.dumps(strict(document), indent=None if line else 2, allow_nan=False) + "\n")
    if line:  # for who waits for the lines of several files
        sys.stdout.flush()

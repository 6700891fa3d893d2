"""The command line as it was given."""

from __future__ import annotations

import shlex

import typer


def command_of(context: typer.Context) -> str:
    """As one would type it again. What ``main`` was given comes with the context."""
    return shlex.join(["gmsnet", *(context.obj or [context.info_name or ""])])

"""The user's own ``gmsh`` module, found or given, and the model in it that is meant."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from gmsnet.errors import InputError


def library(given: Any = None) -> Any:
    """The module ``gmsh`` of the user: as given, else as imported already.

    Raises InputError where it is not imported, not that module, or not initialised.
    """
    gmsh = sys.modules.get("gmsh") if given is None else given
    if gmsh is None:
        raise InputError("Gmsh is not at work here: import gmsh, call gmsh.initialize() and open or make a model first")
    if not hasattr(gmsh, "model") or not hasattr(gmsh, "isInitialized"):
        raise InputError(f"gmsh must be the module of Gmsh's Python interface, got {type(gmsh).__name__}")
    if not gmsh.isInitialized():
        raise InputError("Gmsh has not been initialised: call gmsh.initialize() and open or make a model first")
    return gmsh


@contextmanager
def current(gmsh: Any, model: str | None) -> Iterator[None]:
    """Makes a model, by its name, the current one for a while. None: the one that is.

    Raises InputError where there is no such model.
    """
    if model is None:
        yield
        return
    names = list(gmsh.model.list())
    if model not in names:
        raise InputError(f"Gmsh has no model {model!r}; it has {', '.join(map(repr, names))}")
    before = gmsh.model.getCurrent()
    gmsh.model.setCurrent(model)
    try:
        yield
    finally:
        gmsh.model.setCurrent(before)

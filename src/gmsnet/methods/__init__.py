"""One smoother a file, and the one table of them that the API, the command line, the docs and the tests read."""

from __future__ import annotations

import difflib

from gmsnet.errors import InputError
from gmsnet.methods import gmsnet
from gmsnet.methods.base import Method, Options, Precision, Smoother

METHODS: dict[str, Method] = {method.name: method for method in (gmsnet.METHOD,)}


def method_named(name: str) -> Method:
    """The row of the table; InputError names the nearest ones for a name that is not in it."""
    if not isinstance(name, str):
        raise InputError(f"method must be the name of one: {', '.join(METHODS)}; got {name!r}")
    if name in METHODS:
        return METHODS[name]
    near = difflib.get_close_matches(name, METHODS, n=3, cutoff=0.4)
    hint = f"did you mean {' or '.join(near)}?" if near else f"choose one of: {', '.join(METHODS)}"
    raise InputError(f"unknown method {name!r}; {hint}")


__all__ = ["METHODS", "Method", "Options", "Precision", "Smoother", "method_named"]

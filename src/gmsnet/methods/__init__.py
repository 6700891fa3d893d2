"""One smoother a file, and the one table of them that the API, the command line, the docs and the tests read."""

from __future__ import annotations

import difflib
import os
from collections.abc import Iterable

from gmsnet.errors import InputError
from gmsnet.methods import (
    angle,
    auto,
    barrier,
    cpt,
    cvt,
    getme,
    gmsnet,
    gmsnet2,
    laplacian,
    nn,
    optimize,
    sized,
    worst_first,
)
from gmsnet.methods.base import Field, Method, MethodOptions, Smoother, StarSmoother, Tally

METHODS: dict[str, Method] = {
    method.name: method
    for method in (
        auto.METHOD,
        gmsnet.METHOD,
        gmsnet2.METHOD,
        laplacian.METHOD,
        angle.METHOD,
        cvt.METHOD,
        cpt.METHOD,
        getme.METHOD,
        optimize.METHOD,
        barrier.METHOD,
        worst_first.METHOD,
        sized.METHOD,
        nn.METHOD,
    )
}


def method_named(name: str) -> Method:
    """The row of the table; InputError names the nearest ones for a name that is not in it."""
    return METHODS[_chosen("method", name, METHODS)]


def chosen(
    name: str,
    *,
    variant: str | None = None,
    objective: str | None = None,
    weights: str | os.PathLike[str] | None = None,
    seed: int = 0,
) -> tuple[Method, MethodOptions]:
    """A method of the table and its options, the defaults for those that are not given.

    Raises InputError for names that are not in the table, with the nearest ones, and for options that the method does
    not have.
    """
    method = method_named(name)
    options = MethodOptions(
        _option(method, "variant", variant, method.variants),
        _option(method, "objective", objective, method.objectives),
        weights,
        seed,
    )
    if weights is not None and not method.weighted:
        raise InputError(f"{name} has no weights, so none can be given; those with weights: {_those('weighted')}")
    if weights is not None and variant is not None:
        raise InputError(f"variants of {name} are its own weights: give either a variant or weights, not both")
    return method, options


def smoother(
    name: str,
    *,
    variant: str | None = None,
    objective: str | None = None,
    weights: str | os.PathLike[str] | None = None,
    seed: int = 0,
) -> Smoother:
    """A method of the table, ready for one run. Raises InputError as ``chosen``, and for weights that are no use."""
    method, options = chosen(name, variant=variant, objective=objective, weights=weights, seed=seed)
    return method.create(options)


def _option(method: Method, kind: str, given: str | None, names: tuple[str, ...]) -> str:
    """The variant or objective to use: the given one, or the default, or "" where there are none."""
    if given is None:
        return names[0] if names else ""
    if not names:
        raise InputError(
            f"{method.name} has no {kind}s, so none can be chosen; those with {kind}s: {_those(f'{kind}s')}"
        )
    return _chosen(f"{kind} of {method.name}", given, names)


def _those(attribute: str) -> str:
    return ", ".join(method.name for method in METHODS.values() if getattr(method, attribute)) or "none"


def _chosen(kind: str, name: str, names: Iterable[str]) -> str:
    """The name, if it is one of the names; else InputError with the nearest ones."""
    names = list(names)
    if not isinstance(name, str):
        raise InputError(f"{kind} must be the name of one: {', '.join(names)}; got {name!r}")
    if name in names:
        return name
    known = {each.casefold(): each for each in names}
    near = difflib.get_close_matches(name.casefold(), known, n=3, cutoff=0.5)
    hint = f"did you mean {' or '.join(known[each] for each in near)}? " if near else ""
    raise InputError(f"unknown {kind} {name!r}; {hint}choose one of: {', '.join(names)}")


__all__ = [
    "METHODS",
    "Field",
    "Method",
    "MethodOptions",
    "Smoother",
    "StarSmoother",
    "Tally",
    "chosen",
    "method_named",
    "smoother",
]

"""Which options go with a metric, and which contradict it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gmsnet.errors import InputError
from gmsnet.measure.report import SHAPE
from gmsnet.preserve.protection import METRIC, NONE

if TYPE_CHECKING:
    from gmsnet.run.options import SmoothOptions


def check_adapting(options: SmoothOptions) -> None:
    """InputError where a metric, or sizes, contradict another option, or cannot be had with it."""
    given = [name for name in ("metric", "size") if getattr(options, name) is not None]
    if len(given) > 1:
        raise InputError("metric and size contradict each other: a size h is the metric of h**-2 times the unit matrix")
    if given and options.preserve not in (SHAPE, NONE):
        raise InputError(f"{given[0]} and preserve={options.preserve!r} contradict each other: leave one of them out")
    what = given[0] if given else f"preserve={METRIC!r}"
    if not given and options.preserve != METRIC:
        return
    if options.method != "auto":
        raise InputError(f"{what} has a method of its own: leave out the method {options.method!r}")
    if options.target:
        raise InputError(f"a target and {what} contradict each other: cells of the metric may be any triangles")
    if options.guard == "star":
        raise InputError(f"the guard 'star' cannot be had with {what}, which moves all nodes at once: use 'worst'")
    if options.best_by != SHAPE:
        raise InputError(f"with {what} meshes are compared in the metric: leave out best_by")

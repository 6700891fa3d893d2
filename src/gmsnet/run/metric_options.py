"""Which options go with a metric, and which contradict it."""

from __future__ import annotations

from collections.abc import Sequence

from gmsnet.errors import InputError
from gmsnet.measure.report import SHAPE
from gmsnet.measure.target import Target
from gmsnet.preserve.protection import METRIC, NONE


def check_adapting(
    given: Sequence[str], *, preserve: str, method: str, target: Target, guard: str, best_by: str
) -> None:
    """InputError where a metric, or sizes, contradict another option, or cannot be had with it.

    given: "metric", "size" or both, whichever the call has.
    """
    if len(given) > 1:
        raise InputError("metric and size contradict each other: a size h is the metric of h**-2 times the unit matrix")
    if given and preserve not in (SHAPE, NONE):
        raise InputError(f"{given[0]} and preserve={preserve!r} contradict each other: leave one of them out")
    what = given[0] if given else f"preserve={METRIC!r}"
    if not given and preserve != METRIC:
        return
    if method != "auto":
        raise InputError(f"{what} has a method of its own: leave out the method {method!r}")
    if target:
        raise InputError(f"a target and {what} contradict each other: cells of the metric may be any triangles")
    if guard == "star":
        raise InputError(f"the guard 'star' cannot be had with {what}, which moves all nodes at once: use 'worst'")
    if best_by != SHAPE:
        raise InputError(f"with {what} meshes are compared in the metric: leave out best_by")

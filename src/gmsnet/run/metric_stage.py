"""The metric that a mesh is to conform to as a stage: the one that is given, or the mesh's own once it is untangled."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.methods.adapt import Adapt
from gmsnet.metric.conformity import Conformity
from gmsnet.metric.field import Metric
from gmsnet.metric.tensors import checked_metric, checked_sizes
from gmsnet.parallel.executor import Executor
from gmsnet.run.options import SmoothOptions
from gmsnet.run.state import State

Floats = NDArray[np.float64]

ALLOWED = 0.05  # of the lengths asked for: so much longer or shorter edges are as many as the metric asks for

STRETCHED = 2.0  # times as long as wide


def check_given(options: SmoothOptions, count: int) -> Floats | None:
    """The logarithms (N, 3) by id of a metric, or of sizes, at the ``count`` nodes of a mesh; None if none is given so.

    Raises InputError for arrays of another shape, and for values that are not positive (definite).
    """
    given, check = _given(options)
    return None if given is None or callable(given) else check(given, count, "node")


def take_metric(state: State, options: SmoothOptions, executor: Executor) -> State:
    """With the metric, with the method that leads to it, and with how the input conforms to it."""
    if not options.adapts or not len(state.topology.near):
        return state
    topology, mesh = state.planar, state.mesh
    function, check = _given(options)
    if state.nodal is not None:
        metric = Metric.at_nodes(topology, state.start, state.nodal[topology.memory], mesh.exponent)
    elif callable(function):

        def logs(points: Floats) -> Floats:
            return check(function(points), len(points), "point")

        metric = Metric.of_place(topology, state.points, logs, mesh.exponent)
    else:
        from gmsnet.preserve.recovered import recovered  # what it needs of SciPy takes time to import

        metric = Metric.at_nodes(topology, state.points, recovered(topology, state.points), own=True)
    before = Conformity.of(state.start, topology, metric)
    remarks = (*state.remarks, _remark(metric, state, options))
    return replace(
        state, metric=metric, smoother=Adapt(metric), conformity=(before,), remarks=remarks, totals=None, nodal=None
    )


def _given(options: SmoothOptions) -> tuple[Any, Callable[[Any, int, str], Floats]]:
    if options.size is not None:
        return options.size, checked_sizes
    return options.metric, checked_metric


def _remark(metric: Metric, state: State, options: SmoothOptions) -> str:
    if metric.own:
        return (
            "the stretch and the sizes of cells were taken for meant, and kept as a smooth metric (preserve='metric'): "
            f"around {metric.stretched(STRETCHED):,} of {len(state.start):,} nodes cells are stretched by "
            f"{STRETCHED:g} or more; if this is not meant, use preserve='none'"
        )
    what, times = "metric" if options.size is None else "size", metric.reachable
    if abs(times - 1.0) <= ALLOWED:
        return f"{what}: the cells are about as many as it asks for"
    few = "too few" if times > 1.0 else "too many"
    return (
        f"{what}: the cells are {few} for it; edges {times:.3g} times as long as it asks are what their number allows"
    )

"""The cycles of methods/worst_first.py on surfaces in space."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.methods import shell
from gmsnet.kernels.methods.ranking import free_nodes
from gmsnet.kernels.methods.worst_first_cycles import LEAST
from gmsnet.kernels.simplex.shell_measures import shell_shapes_of
from gmsnet.kernels.star.guard import Guard
from gmsnet.methods.base import Field, Tally
from gmsnet.topology.shell import Shell


def cycles_on_surface(
    field: Field, topology: Shell, cells: NDArray[np.int32], guard: Guard, plan: list[tuple[int, int, int]],
    tally: Tally,
) -> tuple[float, float, float]:  # fmt: skip
    """As kernels.methods.worst_first_cycles.cycles."""
    simplices, memory = topology.changeable, topology.memory
    mark, shape = np.zeros(len(field.points), dtype=np.bool_), np.empty(len(cells))
    shell_shapes_of(field.points, simplices, cells, shape)
    before = late = float(shape.min(initial=math.inf))
    for wanted, doublings, sweeps in plan:
        late = float(shape.min(initial=math.inf))
        limit = np.partition(shape, min(wanted, len(cells)) - 1)[min(wanted, len(cells)) - 1]
        scale = max(late, LEAST) / math.sqrt(3.0)
        nodes = free_nodes(simplices.rows, cells, shape, limit, topology.near_free, memory, mark)
        stars = topology.stars_of(nodes)
        shell.visit(field.points, stars, nodes, guard, doublings, sweeps, scale, mark, tally)
        shell_shapes_of(field.points, simplices, cells, shape)
    return before, late, float(shape.min(initial=math.inf))

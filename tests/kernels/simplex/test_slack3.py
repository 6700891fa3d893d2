"""The slack of cells that are looked at together is that of each alone, to the bit."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.blocks import block

from gmsnet.kernels.jit.compile import kernel
from gmsnet.kernels.simplex.mean_ratio3 import HEXAHEDRON
from gmsnet.kernels.simplex.slack3 import ALONE, CELLS, FOR_ONE, SLACK, slack_of, slacks_of
from gmsnet.measure.report import connectivity_of
from gmsnet.topology.ordering import near_points

UNIT, GRAIN = 2.0**-53, 1e-14


@kernel
def alone_and_together(points, solids, cells, numbers, moved, place, alone, together):
    work, count = np.empty(ALONE * CELLS + FOR_ONE), len(numbers)
    x, y, z = place
    slacks_of(points, solids, cells, numbers, count, UNIT, GRAIN, moved, x, y, z, work)
    for lane in range(count):
        cell = cells[numbers[lane]]
        together[lane] = work[SLACK * CELLS + lane]
        is_hexahedron = solids.kind[cell] == HEXAHEDRON
        alone[lane] = slack_of(points, solids.nodes[cell], is_hexahedron, UNIT, GRAIN, moved, x, y, z, work)


@pytest.mark.parametrize("options", [{}, {"wedges": np.ndindex(3, 3)}, {"wedges": [(0, 1), (2, 2)]}])
@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10**6), count=st.integers(1, CELLS), amount=st.sampled_from([0.0, 0.1, 0.3, 0.6]))
def test_slack_is_that_of_each_cell_alone(options, seed, count, amount):
    random, mesh = np.random.default_rng(seed), block(3, 3, 3, **options)
    topology = connectivity_of(mesh)
    points, cells = near_points(mesh, topology), topology.inexact_cells
    points[:, :3] += amount * (random.random((len(points), 3)) - 0.5)
    numbers = random.integers(len(cells), size=count).astype(np.int32)
    moved = int(random.integers(len(points)))
    place = tuple(points[moved, :3] + amount * (random.random(3) - 0.5))
    alone, together = np.empty(count), np.empty(count)
    solids = topology.all_simplices.solids
    alone_and_together(points, solids, cells, numbers, moved, place, alone, together)
    assert alone.tobytes() == together.tobytes()
    assert amount > 0.0 or (alone > 0.0).all()

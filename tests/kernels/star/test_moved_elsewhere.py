"""Nodes that another guard has moved use up the slack of their cells; where none is left, nothing is known."""

from __future__ import annotations

import numpy as np
import pytest
from support.blocks import block

from gmsnet.measure.report import connectivity_of
from gmsnet.topology.ordering import near_points


@pytest.mark.parametrize("options", [{}, {"wedges": np.ndindex(3, 3)}])
def test_slack_is_used_up_by_what_others_move(options):
    mesh = block(3, 3, 3, **options)
    topology = connectivity_of(mesh)
    points, node = near_points(mesh, topology), int(np.flatnonzero(topology.near_free)[0])
    at = np.arange(topology.inexact_at[node], topology.inexact_at[node + 1])
    at = topology.inexact[at]
    cells = np.unique(at >> 3)
    assert len(cells) == 8 if not options else len(cells) > 8
    topology.slack[:], topology.gone[:] = 1.0, 0.0

    def pushed(far):
        before = points[[node], :3].copy()
        points[node, 0] += far
        topology.moved_elsewhere(points, np.array([node]), before)

    pushed(0.4)
    assert topology.gone[at] == pytest.approx(0.4)
    assert (topology.gone[at] >= 0.4).all()
    assert (np.delete(topology.gone, at) == 0.0).all()
    assert (topology.slack == 1.0).all()
    pushed(-0.7)
    assert topology.gone[at] == pytest.approx(1.1)
    assert (topology.slack[cells] == 0.0).all()
    assert (np.delete(topology.slack, cells) == 1.0).all()

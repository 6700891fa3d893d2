"""Why a run with a target ended, by the cells of the result."""

from __future__ import annotations

import pytest

from gmsnet.run import stop


@pytest.mark.parametrize("reason", [stop.NO_PROGRESS, stop.MAX_SWEEPS, stop.NOTHING_TO_MOVE, stop.TARGET_REACHED])
def test_no_cell_that_misses_it_is_a_target_reached(reason):
    assert stop.by_target(reason, 0, swept=True) == stop.by_target(reason, 0, swept=False) == stop.TARGET_REACHED


def test_a_cell_that_misses_it_is_none():
    assert stop.by_target(stop.TARGET_REACHED, 1, swept=True) == stop.NO_PROGRESS
    assert stop.by_target(stop.TARGET_REACHED, 1, swept=False) == stop.NOTHING_TO_MOVE
    assert stop.by_target(stop.MAX_SWEEPS, 1, swept=True) == stop.MAX_SWEEPS


@pytest.mark.parametrize("reason", [stop.CALLBACK, stop.INTERRUPTED])
def test_who_ended_it_is_told(reason):
    assert stop.by_target(reason, 0, swept=True) == stop.by_target(reason, 3, swept=True) == reason


@pytest.mark.parametrize("reason", [stop.NO_PROGRESS, stop.MAX_SWEEPS, stop.IN_PLACE])
def test_without_a_target_it_stays(reason):
    assert stop.by_target(reason, None, swept=True) == reason

"""Volumes with flat cells, and with cells that have to grow together, over ranks."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("mpi4py", reason="mpi4py is not installed")

from support.hard_volumes import core, slivers, spiked
from support.ranks import parts_at_random, same

from gmsnet.methods.auto import WHOLE_WORST
from gmsnet.run.options import SmoothOptions


@pytest.mark.parametrize("make", [core, slivers])
@pytest.mark.parametrize(("ranks", "how"), [(2, "strips"), (3, "interleaved")])
def test_they_have_the_bits_of_one_process(make, ranks, how):
    mesh = make()
    told = same(mesh, SmoothOptions(threads=1), parts_at_random(mesh, ranks, np.random.default_rng(0), how), ranks)
    assert told.gathered == "" or make is slivers  # whose cells are wound both ways: some are turned for their sign


@pytest.mark.parametrize("kind", ["pyramid", "mixed"])
@pytest.mark.parametrize(("ranks", "how"), [(2, "strips"), (3, "interleaved"), (2, "one")])
def test_all_nodes_at_once_have_the_bits_of_one_process(kind, ranks, how):
    mesh = spiked(kind)
    parts = parts_at_random(mesh, ranks, np.random.default_rng(0), how)
    told = same(mesh, SmoothOptions(threads=1, preserve="none"), parts, ranks)
    assert any(WHOLE_WORST in sweep.stage and sweep.moved for sweep in told.history)

"""Cells that untangling left are tried once more, from where sweeps have taken the nodes around them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.blocks import block, inner_nodes

import gmsnet
from gmsnet.run import stages


def bent(seed):
    """A block that is bent until its corners cannot all be valid, its inner nodes thrown."""
    rng, mesh = np.random.default_rng(seed), block(4, 4, 4)
    x, y, z = mesh.points.T
    points = np.column_stack([x + 0.35 * z * np.sin(y), y * (1.0 + 0.4 * np.sin(x)), z])
    return replace(mesh, points=points + inner_nodes(mesh)[:, None] * rng.normal(0.0, 0.5, points.shape))


def told(result):
    return [note for note in result.notes if note.startswith("untangling:")]


def test_as_long_as_it_mends(monkeypatch):
    meshes = [bent(seed) for seed in range(12)]
    after = [gmsnet.smooth(mesh) for mesh in meshes]
    monkeypatch.setattr(stages, "AGAIN", 0)
    once = [gmsnet.smooth(mesh) for mesh in meshes]
    pairs = [(one.after.inverted, two.after.inverted) for one, two in zip(once, after, strict=True)]
    assert all(two <= one for one, two in pairs)
    assert sum(two < one for one, two in pairs) >= 2
    for one, two in zip(once, after, strict=True):
        assert len(told(one)) == 1
        assert (len(told(two)) > 1) == (two.after.inverted < one.after.inverted)
        # What is left is told, each cell with its reason.
        assert len(two.unmended) == two.after.inverted


def test_not_where_most_is_left(monkeypatch):
    monkeypatch.setattr(stages, "untangle_left", lambda *_: pytest.fail("most cells were left"))
    mesh = block(3, 3, 3)
    turned = mesh.points.copy()
    turned[(turned == 0.0).sum(axis=1) == 3] = (1.6, 1.6, 1.6)  # a corner of the block, which is held
    result = gmsnet.smooth(replace(mesh, points=turned))
    assert result.after.inverted > 0

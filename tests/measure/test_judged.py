"""What is said of the cells with a free node."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import gmsnet
from gmsnet.generate import structured_mesh
from gmsnet.measure.judged import DEAR, UNKNOWN, Judged


def pinched():
    """Even quads over a high bump: the worst of them gain at the cost of many good ones."""
    mesh = structured_mesh(24, 7)
    x, y = 3.0 * mesh.points[:, 0], mesh.points[:, 1]
    bump = 0.8 * np.exp(-8.0 * (x - 1.5) ** 2)
    return mesh.with_points(np.column_stack([x, bump + (1.0 - bump) * y]))


def test_a_mean_that_falls_for_the_least_is_told():
    mesh = pinched()
    result = gmsnet.smooth(mesh)
    before, after = result.judged
    assert after.shape_mean < before.shape_mean - DEAR
    assert after.shape_min > before.shape_min
    (said,) = (note for note in result.notes if note.startswith("the mean 1/q fell"))
    for figure in (before.shape_mean, after.shape_mean, before.shape_min, after.shape_min):
        assert f"{figure:.4f}" in said
    aimed = gmsnet.smooth(mesh, target_quality=0.5 * (before.shape_min + after.shape_min))
    assert not any("fell" in note for note in aimed.notes)
    assert aimed.judged.after.shape_mean > after.shape_mean


@pytest.mark.parametrize(
    "after", [{"shape_mean": 0.79}, {"shape_mean": 0.7, "shape_min": 0.1}, {"shape_mean": 0.7, "shape_min": 0.3}]
)
@pytest.mark.parametrize("inverted", [0, 1])
def test_it_is_of_valid_meshes_whose_least_has_gained(after, inverted):
    totals = gmsnet.smooth(structured_mesh(4)).judged.before
    first = replace(totals, shape_mean=0.8, shape_min=0.2, inverted=inverted)
    last = replace(first, **after)
    told = Judged(first, last).price("1/q")
    assert bool(told) == (not inverted and last.shape_mean < 0.78 and last.shape_min > 0.2)


def test_of_nothing_nothing_is_told():
    assert UNKNOWN.price("η") == []

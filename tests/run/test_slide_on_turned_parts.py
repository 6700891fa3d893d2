"""Turned parts of planes, cylinders, cones and tori, nodes of rims sliding along: all stay on the true part."""

from __future__ import annotations

import os

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.revolved import PARTS, part

import gmsnet
from gmsnet.constraints.shell import FEATURE

EXAMPLES = int(os.environ.get("GMSNET_GUARD_EXAMPLES", "40"))


def away_from(part, group, places):
    """(K,) how far places are from the nearest piece of a group."""
    return np.min([p.away(places) for p, g in zip(part.pieces, part.groups, strict=True) if g == group], axis=0)


def mean_edges(points, rows):
    ends = np.concatenate([rows[:, [k - 1, k]] for k in range(3)])
    length = np.linalg.norm(points[ends[:, 0]] - points[ends[:, 1]], axis=1)
    return np.bincount(ends.ravel(), np.repeat(length, 2)) / np.bincount(ends.ravel())


@settings(max_examples=EXAMPLES)
@given(
    name=st.sampled_from(PARTS), seed=st.integers(0, 10**6), thrown=st.sampled_from([0.0, 0.2, 0.3, 0.4]),
    power=st.integers(-4, 4), rotated=st.booleans(), loose=st.booleans(),
)  # fmt: skip
def test_nodes_stay_on_the_true_part(name, seed, thrown, power, rotated, loose):
    made = part(name, seed, thrown, 10.0**power, rotated)
    points, rows = made.mesh.points, made.mesh.cells[0].nodes
    result = gmsnet.smooth(made.mesh, slide=True, surface_tolerance=0.5 if loose else 0.05)
    assert result.after.shape.min() >= result.before.shape.min()
    assert result.after.shape.mean() > result.before.shape.mean()
    assert result.moved.any()
    now, of = made.back(result.points), made.groups[made.of]
    edge = mean_edges(points, rows) / 10.0**power
    for group in np.unique(of):
        on = (of == group).any(axis=1)
        facets = points[rows[on[rows].all(axis=1)]]
        places = np.concatenate([facets.mean(axis=1), *((facets[:, k - 1] + facets[:, k]) / 2 for k in range(3))])
        own = away_from(made, group, made.back(places)).max()  # of the input's facets
        assert away_from(made, group, now[on]).max() <= own + 1e-13
    rims = np.flatnonzero((of[:, 0] != of[:, 1]) & result.moved)
    if loose:
        true = np.array([made.pieces[k].end for k in made.of[rims, 0]])
        assert (np.linalg.norm(now[rims] - true, axis=1) <= 1e-5 * edge[rims]).all()
    assert not result.moved[made.tips].any()
    assert np.isin(made.tips, result.held.get(FEATURE, [])).all()


@pytest.mark.parametrize("name", PARTS)
def test_without_sliding_rims_keep_their_bits(name):
    made = part(name, 7)
    result = gmsnet.smooth(made.mesh)
    of = made.groups[made.of]
    assert not result.moved[of[:, 0] != of[:, 1]].any()
    assert result.moved[of[:, 0] == of[:, 1]].any()

"""Networks that propose garbage: weights of any size and sign, and results that are no numbers, harm no mesh."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from safetensors.numpy import save

import gmsnet
from gmsnet import weights
from gmsnet.generate import disturb
from gmsnet.topology.topology import Topology

SHAPES = {"gmsnet": weights.shapes.gmsnet(8), "gmsnet2": weights.shapes.gmsnet2(8), "nn": weights.shapes.nn()}
EXTREMES = np.array([0.0, -0.0, 1.0, -1.0, 1e-45, 1e-38, 1e10, -1e10, 1e30, -1e30, 3.4e38, -3.4e38], dtype=np.float32)


def qualities(points, cells):
    """The exact area, and D/L, of each triangle."""
    found = []
    for (ax, ay), (bx, by), (cx, cy) in ([[Fraction(v) for v in points[n].tolist()] for n in cell] for cell in cells):
        double = (ax - cx) * (by - cy) - (ay - cy) * (bx - cx)
        first, second = (ax - bx) ** 2 + (ay - by) ** 2, (bx - cx) ** 2 + (by - cy) ** 2
        found.append((double, double / (first + second + (cx - ax) ** 2 + (cy - ay) ** 2)))
    return found


def rank(report):
    return report.inverted, -report.qhat


def check(mesh, result):
    cells = mesh.cells[0].nodes
    before, after = qualities(mesh.points, cells), qualities(result.points, cells)
    assert np.isfinite(result.points).all()
    assert (result.points[~result.moved] == mesh.points[~result.moved]).all()
    held = np.concatenate([*result.held.values()])
    assert not result.moved[held].any()
    assert all(now > 0 for (was, _), (now, _) in zip(before, after, strict=True) if was > 0)
    assert sum(now <= 0 for now, _ in after) <= sum(was <= 0 for was, _ in before)
    assert rank(result.after) <= rank(result.before)
    if all(was > 0 for was, _ in before):
        assert min(quality for _, quality in after) >= min(quality for _, quality in before)


@pytest.mark.parametrize("model", SHAPES)
@pytest.mark.parametrize("guard", ["valid", "worst", "star"])
@given(seed=st.integers(0, 2**32 - 1), tangled=st.booleans(), scale=st.sampled_from([0, 1, 30, 1e30]))
@settings(max_examples=40, deadline=None)
def test_weights_of_any_size_harm_no_mesh(model, guard, tmp_path_factory, seed, tangled, scale):
    rng = np.random.default_rng(seed)

    def values(shape):
        if scale == 0:
            return rng.choice(EXTREMES, shape)
        return np.clip(scale * rng.normal(size=shape), -3e38, 3e38).astype(np.float32)

    path = tmp_path_factory.mktemp("garbage") / "w.safetensors"
    metadata = {"model": model, "format_version": "1", "activation": "silu" if seed % 2 else "relu"}
    path.write_bytes(save({name: values(shape) for name, shape in SHAPES[model].items()}, metadata=metadata))
    mesh = gmsnet.random_mesh(60, seed=seed % 7)
    if tangled:
        mesh = disturb(mesh, Topology.of(mesh).free, 0.8, seed=seed, keep_valid=False)
    result = gmsnet.smooth(mesh, model, weights=path, guard=guard, untangle=False, max_sweeps=6)
    if guard == "valid":  # with which the best mesh is still taken, but its worst cell may be worse
        assert result.after.valid[result.before.valid].all()
        assert rank(result.after) <= rank(result.before)
    else:
        check(mesh, result)


@pytest.mark.parametrize("model", SHAPES)
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e30])
def test_networks_whose_results_are_no_numbers_move_nothing_or_do_no_harm(model, bad, monkeypatch):
    """Past the check of the file: as if a bug had made them."""
    load = weights.load

    def broken(*given, **options):
        trained = load(*given, **options)
        tensors = {name: np.full_like(tensor, bad) for name, tensor in trained.tensors.items()}
        return weights.Weights(trained.model, tensors, trained.metadata)

    mesh = gmsnet.random_mesh(60, seed=1)
    monkeypatch.setattr(weights, "load", broken)
    result = gmsnet.smooth(mesh, model, max_sweeps=4)
    check(mesh, result)
    if not np.isfinite(bad):
        assert not result.moved.any()

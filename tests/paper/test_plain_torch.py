"""The methods for one node at a time in PyTorch, against the models of training and the compiled kernels."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from support.random_stars import proposed, size, star

import gmsnet
from gmsnet import weights
from gmsnet.kernels.jit.compile import LANES
from gmsnet.kernels.methods import adam
from gmsnet.kernels.simplex.objectives import METRIC, OUT
from gmsnet.learn.backend import torch
from gmsnet.learn.data import Stars
from gmsnet.learn.model import GMSNet
from gmsnet.methods.optimize import step_sizes
from gmsnet.paper import plain, plain_torch
from gmsnet.topology.topology import Topology


def stars_of(rng):
    """Of all degrees, sizes and places, some of them tangled."""
    stars = [star(rng, degree, *place) for degree in range(3, 15) for place in ((1.0, 0.0), (1e-6, 1e3), (1e6, 10.0))]
    return stars + [(c + 2.0 * rng.normal(size=2), r) for c, r in stars[::3]]


def plain_shifts(move, stars):
    """Over the sizes of the stars."""
    out = []
    for centre, ring in stars:
        target = move(tuple(map(float, centre)), [tuple(map(float, p)) for p in ring])
        out.append((np.array(target) - centre) / size(centre, ring))
    return np.array(out)


def test_gmsnet_is_the_model_of_training():
    stars = stars_of(np.random.default_rng(1))
    most = max(len(ring) for _, ring in stars)
    rings = np.array([np.vstack([ring, np.zeros((most - len(ring), 2))]) for _, ring in stars])
    several = Stars.of(np.array([c for c, _ in stars]), rings, np.array([len(ring) for _, ring in stars]))
    net = GMSNet.from_tensors(weights.load().tensors)
    wanted = net.propose(several) / several.size[:, None]
    np.testing.assert_allclose(plain_shifts(plain_torch.gmsnet(), stars), wanted, rtol=0, atol=1e-6)
    exact = net.double().propose(several) / several.size[:, None]
    np.testing.assert_allclose(plain_shifts(plain_torch.gmsnet(dtype=torch.float64), stars), exact, rtol=0, atol=1e-12)


def compiled_adam(stars):
    state, out, other = np.empty(adam.STATE * LANES), np.empty(OUT * LANES), np.empty(2 * LANES)

    def propose(local, n, shift):
        adam.propose(METRIC, local, n, None, step_sizes(), state, out, shift, other)

    return proposed(stars, propose) / [[size(*s)] for s in stars]


def test_optim_smoothing_is_the_compiled_adam():
    stars = stars_of(np.random.default_rng(2))
    compiled = compiled_adam(stars)
    twin = plain_shifts(plain_torch.optim_smoothing(torch.float64), stars)
    np.testing.assert_allclose(twin, compiled, rtol=0, atol=1e-9)
    np.testing.assert_allclose(plain_shifts(plain_torch.optim_smoothing(), stars), compiled, rtol=0, atol=1e-5)


def test_optim_smoothing_makes_twenty_steps(monkeypatch):
    evaluated = []
    original = plain_torch.MetricLoss.__call__
    monkeypatch.setattr(plain_torch.MetricLoss, "__call__", lambda self, p: evaluated.append(p) or original(self, p))
    rng = np.random.default_rng(3)
    plain_shifts(plain_torch.optim_smoothing(), [star(rng, 6)])
    assert len(evaluated) == 20


def test_nn_smoothing_is_its_formula_and_the_mean_of_the_ring_in_other_degrees(monkeypatch):
    rng = np.random.default_rng(4)
    widths = {n: (2 * n, 5 + n, 7, 2) for n in (3, 6, 9)}
    tensors = {}
    for n, w in widths.items():
        for k in range(3):
            tensors[f"degree{n}.{k}.weight"] = rng.normal(size=(w[k + 1], w[k])).astype(np.float32)
            tensors[f"degree{n}.{k}.bias"] = rng.normal(size=w[k + 1]).astype(np.float32)
    loaded = {"nn": SimpleNamespace(tensors=tensors)}
    monkeypatch.setattr(plain_torch.weights, "load", lambda path, model: loaded[model])
    stars = [s for s in stars_of(rng) if len(s[1]) < 11]
    wanted = []
    for centre, ring in stars:
        n, low = len(ring), ring.min(axis=0)
        d = (ring.max(axis=0) - low).max()
        place = ring.mean(axis=0)
        if n in widths:
            value = ((ring - low) / d).ravel()
            for k in range(3):
                value = tensors[f"degree{n}.{k}.weight"] @ value + tensors[f"degree{n}.{k}.bias"]
                value = 1 / (1 + np.exp(-value)) if k < 2 else value
            place = low + d * value
        wanted.append((place - centre) / size(centre, ring))
    assert {len(ring) for _, ring in stars} == set(range(3, 11))
    np.testing.assert_allclose(plain_shifts(plain_torch.nn_smoothing(), stars), wanted, rtol=0, atol=1e-5)


@pytest.mark.parametrize("make", [plain_torch.gmsnet, plain_torch.optim_smoothing])
def test_sweeps_make_a_mesh_better(make):
    mesh = gmsnet.random_mesh(60, seed=1)
    topology = Topology.of(mesh)
    twin = plain.PlainMesh.of(mesh, topology)
    before = gmsnet.quality(mesh)
    for _ in range(2):
        assert plain.sweep(twin, make()) > 50
    after = gmsnet.quality(mesh.with_points(twin.array()))
    assert after.inverted == 0
    assert after.shape.mean() > before.shape.mean() + 0.1

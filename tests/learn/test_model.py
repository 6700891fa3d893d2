from __future__ import annotations

import math

import numpy as np
import pytest

from gmsnet.errors import InputError
from gmsnet.learn import dense
from gmsnet.learn.backend import torch
from gmsnet.learn.data import Stars
from gmsnet.learn.model import GMSNet, wheels
from gmsnet.weights import shapes


def random_net(hidden: int, seed: int = 0) -> GMSNet:
    """All parameters random, the norm's among them (they start as ones and zeros)."""
    rng = np.random.default_rng(seed)
    return GMSNet.from_tensors(
        {name: rng.normal(size=s).astype(np.float32) for name, s in shapes.gmsnet(hidden).items()}
    )


def naive_shift(tensors, ring):
    """The network on one star, (n × 2) scaled neighbours around the origin, by the paper's formulas in plain loops."""
    t = {name: values.astype(float).tolist() for name, values in tensors.items()}
    hidden = len(t["linear.bias"])
    nodes = [[0.0, 0.0], *ring.tolist()]
    count = len(nodes)
    features = [
        [
            sum(w * x for w, x in zip(t["linear.weight"][h], node, strict=True)) + t["linear.bias"][h]
            for h in range(hidden)
        ]
        for node in nodes
    ]
    normed = [[0.0] * hidden for _ in nodes]
    for h in range(hidden):
        mean = sum(row[h] for row in features) / count
        left = [row[h] - t["norm.mean_scale"][h] * mean for row in features]
        moment = sum(value * value for value in left) / count
        for i in range(count):
            normed[i][h] = t["norm.weight"][h] * left[i] / math.sqrt(moment + 1e-5) + t["norm.bias"][h]
    adjacency = [[0.0] * count for _ in nodes]
    for i in range(count):
        adjacency[i][i] = 1.0
    for i in range(1, count):
        following = i % (count - 1) + 1
        adjacency[0][i] = adjacency[i][0] = adjacency[i][following] = adjacency[following][i] = 1.0
    degree = [sum(row) for row in adjacency]
    inner = []
    for h in range(hidden):
        gathered = t["gcn.bias"][h]
        for i in range(count):
            weight = adjacency[0][i] / math.sqrt(degree[0] * degree[i])
            gathered += weight * sum(t["gcn.weight"][h][k] * max(normed[i][k], 0.0) for k in range(hidden))
        inner.append(gathered + normed[0][h])
    inner = [sum(t["mlp.0.weight"][h][k] * inner[k] for k in range(hidden)) + t["mlp.0.bias"][h] for h in range(hidden)]
    mean = sum(inner) / hidden
    variance = sum((value - mean) ** 2 for value in inner) / hidden
    inner = [max((value - mean) / math.sqrt(variance + 1e-5), 0.0) for value in inner]
    return [sum(t["mlp.1.weight"][k][h] * inner[h] for h in range(hidden)) + t["mlp.1.bias"][k] for k in range(2)]


def shifts(net: GMSNet, stars: Stars, dtype=torch.float64) -> np.ndarray:
    with torch.no_grad():
        return net.to(dtype)(wheels(torch.as_tensor(stars.ring, dtype=dtype), torch.as_tensor(stars.degree))).numpy()


@pytest.mark.parametrize("hidden", [4, 8, 13, 64])
def test_equals_the_formulas_in_plain_loops(stars, hidden):
    net = random_net(hidden)
    few = slice(0, 200 if hidden < 64 else 20)
    stars = Stars(stars.ring[few], stars.degree[few], stars.size[few])
    expected = [naive_shift(net.tensors(), ring[:n]) for ring, n in zip(stars.ring, stars.degree, strict=True)]
    assert np.abs(shifts(net, stars) - expected).max() < 1e-12
    assert np.abs(shifts(net, stars, torch.float32) - expected).max() < 2e-4


@pytest.mark.parametrize(("hidden", "parameters"), [(4, 74), (8, 210), (16, 674), (64, 8834)])
def test_parameters(hidden, parameters):
    assert sum(p.numel() for p in GMSNet(hidden).parameters()) == parameters == 2 * hidden**2 + 10 * hidden + 2
    assert {name: value.shape for name, value in GMSNet(hidden).tensors().items()} == shapes.gmsnet(hidden)


def test_a_star_alone_and_among_others_moves_alike(stars):
    net = random_net(8)
    together = shifts(net, stars)
    for k in (0, 7, 199):
        n = stars.degree[k]
        alone = Stars(stars.ring[k : k + 1, :n], stars.degree[k : k + 1], stars.size[k : k + 1])
        assert shifts(net, alone)[0] == pytest.approx(together[k], abs=1e-13)


def test_order_of_the_neighbours_does_not_matter(stars):
    rng = np.random.default_rng(1)
    net = random_net(8)
    mixed = stars.ring.copy()
    for ring, n in zip(mixed, stars.degree, strict=True):
        ring[:n] = ring[rng.permutation(n)]
    assert np.abs(shifts(net, Stars(mixed, stars.degree, stars.size)) - shifts(net, stars)).max() < 1e-12


@pytest.mark.parametrize("size", [1e-9, 1.0, 1e9])
@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_scale_and_place_do_not_matter(stars, size, offset):
    net = random_net(8)
    place = size * offset * np.array([1.0, -0.7])
    inside = (np.arange(stars.ring.shape[1]) < stars.degree[:, None])[:, :, None]
    ring = np.where(inside, size * stars.ring + place, 0.0)
    moved = Stars.of(np.broadcast_to(place, (len(stars), 2)), ring, stars.degree)
    assert moved.size == pytest.approx(size, rel=1e-9)
    assert net.propose(moved) / size == pytest.approx(net.propose(stars) / stars.size[:, None], abs=2e-5)


def test_every_parameter_gets_a_gradient(stars):
    net = random_net(8)
    batch = wheels(torch.as_tensor(stars.ring, dtype=torch.float32), torch.as_tensor(stars.degree))
    net(batch).square().sum().backward()
    for name, parameter in net.named_parameters():
        # The InstanceNorm takes away what all features have in common; nothing else is without effect.
        assert parameter.grad is not None, name
        assert torch.isfinite(parameter.grad).all(), name
        assert (parameter.grad != 0).any(), name


def test_parameters_survive_the_names_of_the_file(stars):
    net = GMSNet(8)
    again = GMSNet.from_tensors(net.tensors())
    assert np.array_equal(again.propose(stars), net.propose(stars))


def test_wheel_of_four():
    ring = torch.tensor([[[1.0, 0], [0, 1], [-1, 0], [0, -1]]])
    wheel = wheels(ring, torch.tensor([4]))
    assert wheel.x.tolist() == [[0, 0], [1, 0], [0, 1], [-1, 0], [0, -1]]
    spokes = {(0, k) for k in range(1, 5)}
    rim = {(1, 2), (2, 3), (3, 4), (4, 1)}
    both = spokes | rim
    assert sorted(map(tuple, wheel.edge_index.T.tolist())) == sorted(both | {(b, a) for a, b in both})


def test_two_neighbours_are_no_star():
    with pytest.raises(InputError, match="at least 3 neighbours, got 2"):
        wheels(torch.zeros(2, 3, 2), torch.tensor([3, 2]))


@pytest.mark.parametrize("hidden", [4, 8, 64])
def test_the_dense_form_is_the_same_network(stars, hidden):
    """Shifts and gradients, as exactly as float64 lets two orders of summation agree."""
    net = random_net(hidden).double()
    ring, degree = torch.as_tensor(stars.ring), torch.as_tensor(stars.degree)
    seen = []
    for shift in (net(wheels(ring, degree)), dense.shifts(net, ring, degree)):
        weight = torch.linspace(-1.0, 1.0, shift.numel(), dtype=torch.float64).reshape(shift.shape)
        seen.append([shift, *torch.autograd.grad((weight * shift).sum(), list(net.parameters()))])
    for graph, padded in zip(*seen, strict=True):
        assert (graph - padded).abs().max() < 1e-10 * (1.0 + graph.abs().max())
    narrow = random_net(hidden)
    with torch.no_grad():
        padded = dense.shifts(narrow, ring.float(), degree)
        assert (narrow(wheels(ring.float(), degree)) - padded).abs().max() < 2e-4


def test_the_dense_form_does_not_see_the_padding(stars):
    net = random_net(8).double()
    ring, degree = torch.as_tensor(stars.ring), torch.as_tensor(stars.degree)
    wider = torch.nn.functional.pad(ring, (0, 0, 0, 3))
    wider[torch.arange(wider.shape[1]) >= degree[:, None]] = 7.0
    assert (dense.shifts(net, wider, degree) - dense.shifts(net, ring, degree)).abs().max() < 1e-12

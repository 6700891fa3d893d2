"""Raw shifts applied to a mesh: what the network proposes, no more and no less."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("torch")

from gmsnet import weights
from gmsnet.generate import random_mesh
from gmsnet.learn import raw
from gmsnet.learn.backend import torch
from gmsnet.learn.data import Stars
from gmsnet.learn.model import GMSNet
from gmsnet.measure.report import measure
from gmsnet.topology.topology import Topology

MESH = random_mesh(150, seed=3)
TRAINED = GMSNet.from_tensors(weights.load().tensors)


def untrained() -> GMSNet:
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(0)
        return GMSNet(8)


@pytest.mark.parametrize("truncate", [False, True])
def test_the_sweep_is_sequential(truncate):
    """One node after the other in the order of the colours, each seen as it stands then."""
    topology = Topology.of(MESH)
    start, ring = topology.patches
    points = MESH.points.copy()
    colours = topology.colours[topology.free]
    for k in np.argsort(colours, kind="stable"):
        node, around = topology.free[k], ring[start[k] : start[k + 1]]
        stars = Stars.of(points[[node]], points[around][None], np.array([len(around)]))
        shift = TRAINED.propose(stars)[0]
        a, b = points[around], np.roll(points[around], -1, axis=0)
        while truncate:
            u, v = a - points[node] - shift, b - points[node] - shift
            if (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0] > 0).all():
                break
            shift = shift / 2
        points[node] += shift
    moved = raw.sweep(TRAINED, MESH, truncate=truncate)
    assert moved.visits == len(topology.free)
    assert np.abs(moved.mesh.points - points).max() < 1e-6


def test_raw_shifts_of_an_untrained_network_invert_and_truncated_ones_do_not():
    topology = Topology.of(MESH)
    free = raw.sweep(untrained(), MESH, truncate=False, topology=topology)
    held = raw.sweep(untrained(), MESH, truncate=True, topology=topology)
    assert measure(free.mesh, topology).inverted > 10
    assert measure(held.mesh, topology).inverted == 0
    assert held.inverting > 10
    still = np.setdiff1d(np.arange(len(MESH.points)), topology.free)
    assert (free.mesh.points[still] == MESH.points[still]).all()
    assert (MESH.points == random_mesh(150, seed=3).points).all()


def test_a_trained_network_inverts_little_and_improves():
    topology = Topology.of(MESH)
    moved = raw.sweep(TRAINED, MESH, truncate=True, topology=topology)
    assert moved.inverting < 0.05 * moved.visits
    assert measure(moved.mesh, topology).shape.mean() > measure(MESH, topology).shape.mean() + 0.1

"""Meshes adapted to a front: their edges are 1 long in its metric, and thin across it."""

from __future__ import annotations

import numpy as np
import pytest

import gmsnet
from gmsnet.errors import InputError
from gmsnet.generate import Front, adapted_mesh


def test_the_mesh_is_stretched_along_the_front_and_valid():
    front = Front(0.04, 10.0, bend=0.05)
    mesh = front.mesh()
    assert gmsnet.quality(mesh).valid.all()
    corners = mesh.points[mesh.cells[0].nodes]
    near = np.abs(corners.mean(axis=1)[:, 0] - 0.5 - 0.05 * np.sin(2 * np.pi * corners.mean(axis=1)[:, 1])) < 0.02
    assert gmsnet.quality(mesh).shape[near].mean() < 0.4
    far = np.abs(corners.mean(axis=1)[:, 0] - 0.5) > 0.4
    assert gmsnet.quality(mesh).shape[far].mean() > 0.9
    lengths = []
    for k in range(3):
        way = corners[:, k] - corners[:, k - 1]
        m = front.metric(0.5 * (corners[:, k] + corners[:, k - 1]))
        lengths.append(
            np.sqrt(m[:, 0] * way[:, 0] ** 2 + 2 * m[:, 1] * way[:, 0] * way[:, 1] + m[:, 2] * way[:, 1] ** 2)
        )
    assert (np.abs(np.concatenate(lengths) - 1.0) < 0.2).mean() > 0.95
    assert {"bottom", "right", "top", "left"} <= set(mesh.markers)
    np.testing.assert_array_equal(mesh.points.min(axis=0), 0.0)
    np.testing.assert_array_equal(mesh.points.max(axis=0), 1.0)


def test_the_metric_is_that_of_the_map_by_differences():
    front, step = Front(0.1, 20.0, 0.1, 0.1), 1e-6
    points = np.random.default_rng(0).random((50, 2))

    def mapped(at):
        middle, _ = front._middle(at[:, 1])
        return front.length * front._integral(at[:, 0], middle)[0] / front._integral(1.0, middle)[0]

    slope = [(mapped(points + step * e) - mapped(points - step * e)) / (2 * step) for e in np.eye(2)]
    wanted = np.column_stack([slope[0] ** 2, slope[0] * slope[1], slope[1] ** 2 + 1.0]) / 0.1**2
    np.testing.assert_allclose(front.metric(points), wanted, rtol=1e-6, atol=1e-4)


def test_the_number_of_nodes_is_about_what_was_asked_for():
    assert len(adapted_mesh(500, 3.0).points) == pytest.approx(500, rel=0.15)
    assert adapted_mesh(200, 3.0).points.tobytes() == adapted_mesh(200, 3.0).points.tobytes()


@pytest.mark.parametrize(
    "call",
    [
        lambda: Front(edge=0.0), lambda: Front(aspect=0.5), lambda: Front(width=-1), lambda: Front(bend=1),
        lambda: adapted_mesh(10), lambda: adapted_mesh(1.5), lambda: adapted_mesh(100, 100.0),
    ],
)  # fmt: skip
def test_what_cannot_be_made_is_refused(call):
    with pytest.raises(InputError):
        call()

"""Near walls shapes get better, areas stay within a tenth, and nothing moves elsewhere."""

from __future__ import annotations

import numpy as np

import gmsnet
from gmsnet.preserve.walls import near_walls
from gmsnet.run.wall_stage import improve_near_walls
from gmsnet.topology.topology import Topology, planar_points


def doubles(points, triangles):
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])


def test_the_airfoil_of_the_real_meshes(real_meshes):
    mesh = gmsnet.read(real_meshes / "mesh_NACA0012_inv.su2")
    topology = Topology.of(mesh)
    kept = near_walls(mesh, topology)
    start = planar_points(mesh)[topology.memory]
    options = {"threads": 1, "best_by": "shape", "guard": "worst"}
    best, _, history = improve_near_walls(mesh, topology, kept, start, [], **options)
    assert 1 <= len(history) <= 20
    inside = kept[topology.memory]
    assert (best[~inside] == start[~inside]).all()
    ratio = doubles(best, topology.near) / doubles(start, topology.near)
    cells = inside[topology.near].all(axis=1)
    assert cells.sum() > 1600
    assert np.abs(ratio[cells] - 1.0).max() <= 0.1
    points = mesh.points.copy()
    points[np.ix_(topology.memory, mesh.plane)] = np.ldexp(best, mesh.exponent)
    near = kept[topology.triangles].all(axis=1)
    before, after = (gmsnet.quality(m).shape[near] for m in (mesh, mesh.with_points(points)))
    assert before.min() < 0.56
    assert after.min() > 0.62
    assert after.mean() > before.mean()
    assert len(improve_near_walls(mesh, topology, kept, start, [], max_sweeps=2, **options)[2]) == 2
    again, _, more = improve_near_walls(mesh, topology, kept, best, history, **options)
    assert more[: len(history)] == history
    assert np.abs((doubles(again, topology.near) / doubles(start, topology.near))[cells] - 1.0).max() <= 0.1


def test_nothing_to_move():
    mesh = gmsnet.random_mesh(100, seed=0)
    topology = Topology.of(mesh)
    start = planar_points(mesh)[topology.memory]
    best, reason, history = improve_near_walls(
        mesh, topology, near_walls(mesh, topology), start, [], threads=1, best_by="shape", guard="worst"
    )
    assert best.tobytes() == start.tobytes()
    assert reason == "nothing to move"
    assert history == []

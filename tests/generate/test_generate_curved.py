"""Second-order meshes: middles and centres where they belong, on shared edges once."""

from __future__ import annotations

import numpy as np
import pytest
from support import curved_meshes

from gmsnet.errors import InputError
from gmsnet.generate import random_mesh
from gmsnet.generate.curved import disc_of_quads, on_circle, second_order, throw, waved
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh


def sides(block):
    """(start, end, middle) of the sides of a block of second-order cells."""
    corners = {"triangle6": 3, "quad8": 4, "quad9": 4}[block.kind]
    return [(row[k], row[(k + 1) % corners], row[corners + k]) for row in block.nodes.tolist() for k in range(corners)]


@pytest.mark.parametrize("quads", ["quad8", "quad9"])
def test_straight_middles_and_centres_lie_in_the_middle(quads):
    base = curved_meshes.quad_grid(3)
    mesh = second_order(base, quads=quads)
    block, lines = mesh.cells
    assert (block.kind, lines.kind) == (quads, "line3")
    for a, b, m in sides(block):
        np.testing.assert_allclose(mesh.points[m], (mesh.points[a] + mesh.points[b]) / 2, atol=1e-15)
    edges = {frozenset(side[:2]): side[2] for side in sides(block)}
    assert len(edges) == len(set(edges.values())) == 24  # 2·3·4 edges, each with one middle
    assert all(edges[frozenset(row[:2])] == row[2] for row in lines.nodes.tolist())
    if quads == "quad9":
        np.testing.assert_allclose(mesh.points[block.nodes[:, 8]], mesh.points[block.nodes[:, :4]].mean(axis=1))
    assert len(mesh.points) == 16 + 24 + 9 * (quads == "quad9")
    np.testing.assert_array_equal(mesh.points[:16], base.points)


def test_the_boundary_lies_on_the_circle_and_inner_edges_bend_as_far_as_asked():
    mesh = second_order(disc_of_quads(2, 12), project=on_circle(1.0), bend=0.1, seed=3)
    lines = mesh.cells[1].nodes
    np.testing.assert_allclose(np.linalg.norm(mesh.points[np.unique(lines)], axis=1), 1.0, atol=1e-15)
    rim = set(lines[:, 2].tolist())
    bends = []
    for a, b, m in sides(mesh.cells[0]):
        if m not in rim:
            off = mesh.points[m] - (mesh.points[a] + mesh.points[b]) / 2
            bends.append(np.linalg.norm(off) / np.linalg.norm(mesh.points[b] - mesh.points[a]))
    assert 0.08 < max(bends) <= 0.1
    again = second_order(disc_of_quads(2, 12), project=on_circle(1.0), bend=0.1, seed=3)
    np.testing.assert_array_equal(again.points, mesh.points)


@pytest.mark.parametrize("seed", range(10))
def test_known_valid_meshes_are_valid_and_thrown_ones_keep_their_boundary(seed):
    good, bad = curved_meshes.known_valid(seed), curved_meshes.thrown(seed)
    assert (curved_meshes.judged(good)[0] == 1).all()
    assert not (curved_meshes.judged(bad)[0] == 1).all()
    held = curved_meshes.cell_table(good)[2]
    np.testing.assert_array_equal(bad.points[held], good.points[held])


def test_nodes_are_thrown_no_further_than_asked():
    mesh = second_order(random_mesh(40, seed=1))
    thrown = throw(mesh, middles=0.2, seed=2)
    corners = np.unique(mesh.cells[0].nodes[:, :3])
    np.testing.assert_array_equal(thrown.points[corners], mesh.points[corners])
    for a, b, m in sides(mesh.cells[0]):
        length = np.linalg.norm(mesh.points[b] - mesh.points[a])
        assert np.linalg.norm(thrown.points[m] - mesh.points[m]) <= 0.2 * length * (1 + 1e-12)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda m: second_order(m, quads="quad7"), "'quad8' or 'quad9'"),
        (lambda m: second_order(m, bend=-1.0), "0 or more"),
        (lambda m: second_order(second_order(m)), "'triangle6'"),
        (lambda m: second_order(Mesh(np.zeros((3, 3)), (CellBlock("triangle", [[0, 1, 2]], [0]),))), "N × 2"),
        (lambda m: throw(m, middles=0.1), "no second-order"),
        (lambda m: throw(second_order(m), middles=np.nan), "0 or more"),
        (lambda m: waved(m, 0.2), "1/2π"),
        (lambda m: disc_of_quads(0), "1 ring"),
        (lambda m: disc_of_quads(1, 6), "multiple of 4"),
    ],
)
def test_what_cannot_be_made_is_refused(make, words):
    with pytest.raises(InputError, match=words):
        make(random_mesh(10))

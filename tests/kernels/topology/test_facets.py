"""Facets of tetrahedra against a dictionary of them."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from support import naive, volumes

from gmsnet.kernels.topology import balls
from gmsnet.kernels.topology import facets as kernels
from gmsnet.kernels.topology.layout import morton_order3

BOUNDARY, INTERFACE, NON_MANIFOLD = 1, 2, 4
some_cells = given(
    seed=st.integers(0, 2**32 - 1), nodes=st.integers(4, 14), count=st.integers(1, 60), of=st.integers(4, 14)
)


def random_cells(rng, nodes, count):
    """Any four different nodes of a few: facets of one, two and more cells, duplicates among them."""
    return np.array([rng.permutation(nodes)[:4] for _ in range(count)], dtype=np.int32)


def matched(cells, nodes):
    twin = np.empty(4 * len(cells), dtype=np.int32)
    keys, numbers = np.empty(4 * len(cells), dtype=np.int64), np.empty(4 * len(cells), dtype=np.int32)
    kernels.match(cells, np.zeros(nodes + 2, dtype=np.int64), keys, numbers, twin)
    return twin


def expected_twins(cells):
    twin = np.full(4 * len(cells), kernels.NON_MANIFOLD)
    for seen in volumes.facets_of(cells).values():
        numbers = [4 * t + k for t, k, _ in seen]
        if len(numbers) == 1:
            twin[numbers] = kernels.ALONE
        elif len(numbers) == 2:
            twin[numbers] = numbers[::-1]
    return twin


@some_cells
@settings(max_examples=60)
def test_what_is_on_the_other_side(seed, nodes, count, of):
    cells = random_cells(np.random.default_rng(seed), nodes, count) + np.int32(of)
    assert matched(cells, nodes + of).tolist() == expected_twins(cells).tolist()


def test_lists_of_many_facets_are_sorted_and_those_of_few_are_not():
    """A fan of cells around one edge, and a node with more facets than are searched one by one."""
    for count in (2, kernels.FEW // 3, kernels.FEW, 100):
        rim = np.arange(count)
        cells = np.column_stack([0 * rim, 0 * rim + 1, 2 + rim, 2 + (rim + 1) % count]).astype(np.int32)
        assert matched(cells, count + 2).tolist() == expected_twins(cells).tolist()
        backwards = cells[:, ::-1] * 0 + (count + 1 - cells)
        assert matched(backwards.astype(np.int32), count + 2).tolist() == expected_twins(backwards).tolist()


def test_cells_that_name_a_node_twice():
    cells = np.array([[0, 0, 1, 2], [0, 1, 2, 3], [3, 3, 3, 3], [1, 2, 1, 2]], dtype=np.int32)
    assert matched(cells, 4).tolist() == expected_twins(cells).tolist()


def parts(cells, nodes):
    twin = matched(cells, nodes)
    piece, orientation = np.full(len(cells), -1, dtype=np.int32), np.ones(len(cells), dtype=np.int8)
    return twin, piece, orientation, kernels.wind(cells, twin, piece, orientation)


def check_parts(cells, nodes):
    _, piece, orientation, consistent = parts(cells, nodes)
    part, turn, possible = volumes.parts_of(cells)
    assert piece.tolist() == part
    assert consistent.tolist() == possible
    for t, p in enumerate(part):
        assert not possible[p] or orientation[t] == turn[t]


@some_cells
@settings(max_examples=60)
def test_parts_and_how_to_read_them(seed, nodes, count, of):
    check_parts(random_cells(np.random.default_rng(seed), nodes, count), nodes)


@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 3))
@settings(max_examples=20)
def test_a_lattice_in_any_order_is_read_as_one(seed, n):
    rng = np.random.default_rng(seed)
    points, cells = volumes.lattice(n)
    mixed = volumes.shuffled(rng, rng.permutation(cells)).astype(np.int32)
    check_parts(mixed, len(points))
    _, piece, orientation, consistent = parts(mixed, len(points))
    assert piece.tolist() == [0] * len(cells)
    assert consistent.tolist() == [True]
    assert abs((orientation * np.sign(volumes.volumes6(points, mixed))).sum()) == len(cells)


@some_cells
@settings(max_examples=60)
def test_marks_of_facets(seed, nodes, count, of):
    rng = np.random.default_rng(seed)
    cells = random_cells(rng, nodes, count)
    region = rng.integers(2, size=count) if seed % 2 else np.empty(0, dtype=np.int64)
    turn = rng.choice([1, -1], count).astype(np.int8)
    marks = np.zeros(nodes, dtype=np.uint16)
    nothing = np.empty(0, dtype=np.uint64)
    agrees = kernels.mark_facets(
        cells, matched(cells, nodes), region, turn, nothing, BOUNDARY, INTERFACE, NON_MANIFOLD, marks
    )  # fmt: skip
    expected, two_sides = [0] * nodes, True
    for facet, seen in volumes.facets_of(cells).items():
        mark = BOUNDARY if len(seen) == 1 else NON_MANIFOLD if len(seen) > 2 else 0
        if len(seen) == 2:
            (t, _, one), (u, _, other) = seen
            mark = INTERFACE if len(region) and region[t] != region[u] else 0
            two_sides &= (one == other) == (turn[t] != turn[u])
        for v in facet:
            expected[v] |= mark
    assert marks.tolist() == expected
    assert agrees == two_sides


def spokes_of(cell, corner, turn):
    """The other nodes of a cell in the order that the names of facets give them."""
    a, b, c = cell[kernels.OPPOSITE[corner]].tolist()
    return [a, b, c] if turn > 0 else [a, c, b]


@some_cells
@settings(max_examples=60)
def test_stars_and_rings(seed, nodes, count, of):
    """Each cell at a node without a mark once, its other nodes of positive volume from the node; rings without gaps."""
    rng = np.random.default_rng(seed)
    cells = random_cells(rng, nodes, count)
    turn = rng.choice([1, -1], count).astype(np.int8)
    marks = (rng.random(nodes) < 0.3).astype(np.uint16)
    counts = np.zeros(nodes, dtype=np.int64)
    balls.count_stars(cells, 0, count, marks, counts)
    start = np.concatenate([[0], np.cumsum(counts)])
    corners, place = np.empty(start[-1], dtype=np.int32), start[:-1].copy()
    balls.list_stars(cells, 0, count, marks, place, corners)
    assert (place == start[1:]).all()
    most = int(rng.integers(3, 12))
    ring_start, local = np.empty(nodes + 1, dtype=np.int64), np.empty((len(corners), 3), dtype=np.uint8)
    ring, middle = np.empty(3 * len(corners) + nodes + 1, dtype=np.int32), int(rng.integers(nodes + 1))
    end = balls.rings(cells, turn, start, corners, 0, middle, ring_start, ring, local, most)
    rest = balls.rings(cells, turn, start, corners, middle, nodes, ring_start, ring[end:], local, most)
    ring_start[middle:] += end
    ring_start[nodes] = end + rest
    for v in range(nodes):
        at = corners[start[v] : start[v + 1]]
        assert (cells[at >> 2, at & 3] == v).all()
        rows = [spokes_of(cells[t], k, turn[t]) for t, k in zip((at >> 2).tolist(), (at & 3).tolist(), strict=True)]
        own = [t for t, cell in enumerate(cells.tolist()) if v in cell and not marks[v]]
        assert [set(row) for row in rows] == [set(cells[t].tolist()) - {v} for t in own]
        for t, row in zip(own, rows, strict=True):
            even = volumes.turns([cells[t].tolist().index(n) for n in (v, *row)])
            assert even == (turn[t] > 0)
        around = ring[ring_start[v] : ring_start[v + 1]].tolist()
        named = list(dict.fromkeys(n for row in rows for n in row))
        assert around == (named if len(named) <= most else [])
        if around:
            assert [[around[k] for k in row] for row in local[start[v] : start[v + 1]].tolist()] == rows


@given(seed=st.integers(0, 2**32 - 1), nodes=st.integers(1, 40), flat=st.integers(0, 3))
@settings(max_examples=30)
def test_order_in_memory_along_a_curve(seed, nodes, flat):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(nodes, 4))
    points[:, :flat] = 0.25
    points[rng.integers(nodes)] = points[0]
    keys, other = np.empty(nodes, dtype=np.int64), np.empty(nodes, dtype=np.int64)
    memory, position = np.empty(nodes, dtype=np.int32), np.empty(nodes, dtype=np.int32)
    morton_order3(points, np.empty((0, 3)), keys, other, memory, position)
    assert memory.tolist() == naive.morton_order3(points[:, :3])
    assert position[memory].tolist() == list(range(nodes))

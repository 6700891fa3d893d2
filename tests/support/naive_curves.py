"""Slow twins of the curves that nodes slide on, and meshes to compare them on."""

from __future__ import annotations

import math
from collections import defaultdict

import numpy as np

from gmsnet import CellBlock, Mesh


def naive_chains(mesh: Mesh, angle: float) -> set[tuple[bool, frozenset[tuple[int, int]]]]:
    """(closed, edges) of each chain, as docs/sliding.md defines it but for straight runs."""
    faces = [
        (row[: block.corners], region)
        for block in mesh.cells
        if block.dimension == 2
        for row, region in zip(block.nodes.tolist(), block.regions.tolist(), strict=True)
    ]
    regions, marks, still = defaultdict(list), defaultdict(set), set()
    around: dict[int, list[tuple[int, int]]] = defaultdict(list)
    for corners, region in faces:
        for k, node in enumerate(corners):
            regions[edge_of(node, corners[k - 1])].append(region)
            around[node].append((corners[k - 1], corners[(k + 1) % len(corners)]))
        if len(set(corners)) < len(corners):
            still |= {node for node in corners if corners.count(node) > 1}
    for block in mesh.cells:
        if block.dimension == 0 or block.nodes.shape[1] > block.corners:
            still |= set(block.nodes.ravel().tolist())
        if block.dimension == 1:
            for row, mark in zip(block.nodes.tolist(), block.regions.tolist(), strict=True):
                edge = edge_of(row[0], row[1])
                marks[edge].add(mark)
                still |= set() if edge in regions else set(edge)
    sides = {edge: tuple(sorted(r)) for edge, r in regions.items() if len(r) != 2 or r[0] != r[1]}
    still |= {node for edge, r in regions.items() if len(r) > 2 for node in edge}
    still |= {node for node, pairs in around.items() if not one_fan(pairs)}
    at = defaultdict(list)
    edges = set(sides) | set(marks)
    for edge in edges:
        for node in edge:
            at[node].append(edge)

    def goes_through(node: int) -> bool:
        if len(at[node]) != 2 or node in still:
            return False
        one, two = at[node]
        if sides.get(one) != sides.get(two) or marks.get(one) != marks.get(two):
            return False
        p = mesh.points[:, :2]
        back, ahead = p[node] - p[sum(one) - node], p[sum(two) - node] - p[node]
        if not (back.any() and ahead.any()):
            return False
        turn = abs(math.atan2(back[0] * ahead[1] - back[1] * ahead[0], back @ ahead))
        return turn < math.radians(angle) - 1e-12 and turn <= math.radians(90.0) + 1e-12

    through = {node for node in at if goes_through(node)}
    found, left = set(), set(edges)
    while left:
        chain, new = set(), [left.pop()]
        while new:
            edge = new.pop()
            chain.add(edge)
            for node in through & set(edge):
                new += [other for other in at[node] if other in left]
                left -= set(at[node])
        found.add(({node for edge in chain for node in edge} <= through, frozenset(chain)))
    return found


def edge_of(a: int, b: int) -> tuple[int, int]:
    return min(a, b), max(a, b)


def one_fan(pairs: list[tuple[int, int]]) -> bool:
    """Whether faces around a node, each with its neighbours before and after it, make one fan, open or closed."""
    links = defaultdict(list)
    for one, two in pairs:
        links[one].append(two)
        links[two].append(one)
    if max(map(len, links.values())) > 2:
        return False
    seen = [pairs[0][0]]
    for node in seen:
        seen += [other for other in dict.fromkeys(links[node]) if other not in seen]
    return len(seen) == len(links)


def patchwork(seed: int, *, even: bool = False) -> Mesh:
    """A jittered grid of triangles and quads of two regions with holes, turned faces, marked lines and a vertex.

    even: the nodes lie on the grid.
    """
    rng = np.random.default_rng(seed)
    wide, high = rng.integers(2, 7, 2)
    x, y = np.meshgrid(np.arange(wide + 1.0), np.arange(high + 1.0))
    points = np.column_stack([x.ravel(), y.ravel()])
    if not even:
        points += rng.choice([0.0, 0.0, 0.1, 0.25]) * rng.standard_normal(points.shape)
    triangles, quads = [], []
    for i in range(wide):
        for j in range(high):
            a = i + j * (wide + 1)
            ring = [a, a + 1, a + wide + 2, a + wide + 1]
            kind = rng.choice(["none", "quad", "triangles", "triangles", "triangles", "half"])
            if kind == "quad":
                quads.append(ring)
            elif kind in ("triangles", "half"):
                triangles += [[ring[0], ring[1], ring[2]], [ring[0], ring[2], ring[3]]][: 1 + (kind == "triangles")]
    blocks = []
    for kind, rows in (("triangle", triangles), ("quad", quads)):
        if rows:
            table = np.array(rows)
            turned = rng.random(len(table)) < rng.choice([0.0, 0.3])
            table[turned] = table[turned, ::-1]
            blocks.append(CellBlock(kind, table, rng.integers(0, rng.integers(1, 3), len(table))))
    if rng.random() < 0.7:
        count = int(rng.integers(1, 12))
        ends = rng.integers(0, len(points) - wide - 1, count)
        other = ends + rng.choice([1, wide + 1, wide + 1, wide + 2], count)
        other = np.minimum(other, len(points) - 1)
        blocks.append(CellBlock("line", np.column_stack([ends, other]), rng.integers(1, 3, count)))
    if rng.random() < 0.3:
        blocks.append(CellBlock("vertex", rng.integers(0, len(points), (1, 1)), np.zeros(1, int)))
    return Mesh(points, tuple(blocks), {(1, 1): "one", (1, 2): "two"}, single=True)


def sagittas(p: np.ndarray, closed: bool) -> np.ndarray:
    """Over each edge of a polyline (K, 2), the height of an arc as sharp as the sharper of the circles through three
    nodes at its ends."""
    last = len(p) - 1
    curvature = np.zeros(len(p))
    for k in range(len(p)):
        if closed or 0 < k < last:
            a, b, c = p[k - 1 if k else last - 1], p[k], p[k + 1 if k < last else 1]
            sides = math.dist(a, b) * math.dist(b, c) * math.dist(a, c)
            area = (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])
            curvature[k] = 2.0 * abs(area) / sides if sides > 0.0 else 0.0
    out = np.zeros(last)
    for k in range(last):
        length = math.dist(p[k], p[k + 1])
        half = min(length * max(curvature[k], curvature[k + 1]) / 2.0, 1.0)
        out[k] = length / 2.0 * half / (1.0 + math.sqrt(1.0 - half * half))
    return out


def naive_arc(piece: np.ndarray, x: float, y: float) -> tuple[float, float, float]:
    """How far along its angle (0 to 1) the point of the circle of an arc nearest to (x, y) lies, and this point.

    By the centre and angles, for arcs that are none too flat.
    """
    a, b = complex(*piece[:2]), complex(*piece[2:4])
    angle = math.atan2(piece[5], piece[4])
    radius = abs(b - a) / (2.0 * math.sin(angle))  # negative: the arc lies to the right
    centre = (a + b) / 2.0 - 1j * (b - a) / abs(b - a) * radius * math.cos(angle)
    u = (complex(x, y) - centre) / (a - centre)
    swept = -math.atan2(u.imag, u.real)  # the way of an arc to the left is clockwise
    swept += 2.0 * math.pi * round((angle - swept) / (2.0 * math.pi))  # behind the nearer end, on the far side too
    place = centre + (a - centre) * u / abs(u)
    return swept / (2.0 * angle), place.real, place.imag

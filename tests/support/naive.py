"""Slow, obvious twins of the compiled kernels. Nothing here is clever: loops, sets and fractions."""

from __future__ import annotations

import itertools
import math
from fractions import Fraction

import numpy as np

from support.exact import whole


def exact_area_sign(a, b, c) -> int:
    """Sign of the area of a triangle, in rational arithmetic."""
    return area_sign(*([Fraction(float(v)) for v in p] for p in (a, b, c)))


def area_sign(a, b, c) -> int:
    """In the arithmetic of the coordinates."""
    (ax, ay), (bx, by), (cx, cy) = a, b, c
    area = (ax - cx) * (by - cy) - (ay - cy) * (bx - cx)
    return (area > 0) - (area < 0)


def signs(points, triangles, turn) -> list[int]:
    numbers, _ = whole(np.ravel(points).tolist())
    exact = np.array(numbers, dtype=object).reshape(np.shape(points)).tolist()
    return [int(w) * area_sign(*(exact[i] for i in t)) for t, w in zip(triangles, turn, strict=True)]


def quality(a, b, c) -> tuple[float, float, float, float]:
    """Smallest angle, largest angle (degrees), 1/q, 1/q_V of one triangle."""
    sides = [math.dist(b, c), math.dist(c, a), math.dist(a, b)]
    angles = []
    for p, q, r in ((a, b, c), (b, c, a), (c, a, b)):
        u, v = (q[0] - p[0], q[1] - p[1]), (r[0] - p[0], r[1] - p[1])
        angles.append(math.degrees(math.atan2(abs(u[0] * v[1] - u[1] * v[0]), u[0] * v[0] + u[1] * v[1])))
    area = 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
    shape = 4 * math.sqrt(3) * area / sum(s * s for s in sides)
    return min(angles), max(angles), shape, 4 * math.sqrt(3) * area / (max(sides) * sum(sides))


def qhat(triangles) -> float:
    """Equation 11 over (low, high, 1/q) rows."""
    low, high, inverse = (np.array(column) for column in zip(*triangles, strict=True))
    angles = (low.mean() + low.min() + 120 - high.max() - high.mean()) / 60
    return float((angles + inverse.mean() + inverse.min()) / 6)


def held_nodes(nodes, triangles, regions, others=(), lines=()) -> set[int]:
    """Nodes that must not move, by the rules read off the definition: see Topology."""
    held = set(range(nodes)) - {v for t in triangles for v in t}
    edges: dict[frozenset[int], list[int]] = {}
    for f, cell in enumerate([*triangles, *others]):
        for i in range(len(cell)):
            edges.setdefault(frozenset((cell[i], cell[(i + 1) % len(cell)])), []).append(f)
    for edge, faces in edges.items():
        if len(faces) != 2 or len({regions[f] for f in faces}) > 1:
            held |= edge
    held |= {v for cell in [*others, *lines] for v in cell}
    for v in range(nodes):
        links = [set(t) - {v} for t in triangles if v in t]
        if not links:
            continue
        ring = {n for link in links for n in link}
        reached = {next(iter(ring))}
        while True:
            more = {n for link in links if link & reached for n in link} | reached
            if more == reached:
                break
            reached = more
        two = all(sum(n in link for link in links) == 2 for n in ring)
        if reached != ring or not two or len(ring) < 3 or any(len(link) != 2 for link in links):
            held.add(v)
    return held


def colours(free, rings) -> dict[int, int]:
    """Node → the first colour that none of its free neighbours of smaller id has. rings: free node → its neighbours."""
    found: dict[int, int] = {}
    for v in sorted(free):
        taken = {found[u] for u in rings[v] if u in found}
        found[v] = next(c for c in itertools.count() if c not in taken)
    return found


def morton_order(points) -> list[int]:
    """Ids along a Morton curve over a grid of 2¹⁶ × 2¹⁶: bit by bit, the bit of y before that of x."""
    low, extent = points.min(axis=0), float(np.ptp(points, axis=0).max())
    scale = 65535.0 / extent if extent > 0.0 else 0.0

    def key(i):
        x, y = (int(c) for c in (points[i] - low) * scale)
        return "".join(a + b for a, b in zip(f"{y:016b}", f"{x:016b}", strict=True)), i

    return sorted(range(len(points)), key=key)


def morton_order3(points) -> list[int]:
    """The same in space, over a grid of 2¹⁰ × 2¹⁰ × 2¹⁰: the bit of z before that of y before that of x."""
    low, extent = points.min(axis=0), float(np.ptp(points, axis=0).max())
    scale = 1023.0 / extent if extent > 0.0 else 0.0

    def key(i):
        x, y, z = (f"{int(c):010b}" for c in (points[i] - low) * scale)
        return "".join(a + b + c for a, b, c in zip(z, y, x, strict=True)), i

    return sorted(range(len(points)), key=key)


def gmsnet_shift(centre, ring, tensors):
    """Equations 4 to 8 for one star, float64, loop by loop: the shift in the coordinates of the star."""
    t = {name: np.asarray(value, dtype=np.float64) for name, value in tensors.items()}
    nodes = np.array([centre, *ring], dtype=np.float64)
    d = np.ptp(nodes, axis=0).max()
    x = (nodes - nodes[0]) / d
    n, hidden = len(ring), len(t["linear.bias"])
    features = np.array([[t["linear.weight"][h] @ p + t["linear.bias"][h] for h in range(hidden)] for p in x])
    normed = np.empty_like(features)
    for h in range(hidden):
        moved = features[:, h] - t["norm.mean_scale"][h] * features[:, h].mean()
        normed[:, h] = t["norm.weight"][h] * moved / math.sqrt((moved**2).mean() + 1e-5) + t["norm.bias"][h]
    adjacency = np.eye(n + 1)
    for j in range(n):
        adjacency[0, j + 1] = adjacency[j + 1, 0] = 1
        k = (j + 1) % n
        adjacency[j + 1, k + 1] = adjacency[k + 1, j + 1] = 1
    scale = np.diag(1 / np.sqrt(adjacency.sum(axis=1)))
    convolved = scale @ adjacency @ scale @ np.maximum(normed, 0) @ t["gcn.weight"].T + t["gcn.bias"] + normed
    inner = t["mlp.0.weight"] @ convolved[0] + t["mlp.0.bias"]
    inner = np.maximum((inner - inner.mean()) / math.sqrt(inner.var() + 1e-5), 0)
    return d * (t["mlp.1.weight"] @ inner + t["mlp.1.bias"])


def nn_shift(centre, ring, tensors):
    """NN-Smoothing for one star, float64, loop by loop: the shift in the coordinates of the star."""
    n = len(ring)
    if f"degree{n}.0.weight" not in tensors:
        return [sum(p[axis] for p in ring) / n - centre[axis] for axis in range(2)]
    low = [min(p[axis] for p in ring) for axis in range(2)]
    side = max(max(p[axis] for p in ring) - low[axis] for axis in range(2))
    values = [(p[axis] - low[axis]) / side for p in ring for axis in range(2)]
    for layer in range(3):
        matrix, bias = (tensors[f"degree{n}.{layer}.{kind}"].astype(float).tolist() for kind in ("weight", "bias"))
        values = [sum(w * v for w, v in zip(row, values, strict=True)) + b for row, b in zip(matrix, bias, strict=True)]
        if layer < 2:
            values = [1 / (1 + math.exp(-v)) for v in values]
    return [low[axis] + side * values[axis] - centre[axis] for axis in range(2)]

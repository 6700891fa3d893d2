"""Meshes of tetrahedra for tests, and slow, obvious twins of what is computed of them: exact numbers, sets, loops."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from fractions import Fraction
from itertools import combinations, permutations

import numpy as np
from scipy.spatial import ConvexHull, Delaunay

from gmsnet import CellBlock, Mesh
from support.exact import whole

FACETS = ((1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1))  # seen from outside of a cell of positive volume


def block(kind, nodes, regions=0):
    nodes = np.asarray(nodes, dtype=np.int64)
    return CellBlock(kind, nodes, np.broadcast_to(np.asarray(regions, dtype=np.int64), len(nodes)).copy())


def mesh_of(points, cells, regions=0, more=(), **options):
    """A mesh of tetrahedra, and further blocks (kind, nodes, regions)."""
    return Mesh(np.asarray(points, float), (block("tetra", cells, regions), *(block(*b) for b in more)), **options)


def volumes6(points, cells):
    """Six times the signed volumes, in floats."""
    a, b, c = (points[cells[:, k]] - points[cells[:, 0]] for k in (1, 2, 3))
    return np.einsum("ij,ij->i", a, np.cross(b, c))


def wound(points, cells):
    """The same cells, all of positive volume."""
    cells = np.array(cells)
    wrong = volumes6(points, cells) < 0
    cells[wrong] = cells[wrong][:, [0, 2, 1, 3]]
    return cells


def shuffled(rng, cells):
    """The same cells in any order of their nodes, so of mixed orientation."""
    return np.array([rng.permutation(cell) for cell in cells]).reshape(-1, 4)


def lattice(n, jitter=0.0, seed=0):
    """(points, cells) of a cube of n³ cubes with six tetrahedra each (Kuhn); inner nodes thrown by jitter/n."""
    rng = np.random.default_rng(seed)
    place = np.arange((n + 1) ** 3).reshape(n + 1, n + 1, n + 1)
    points = np.argwhere(place >= 0).astype(float) / n
    cells = []
    for way in permutations(np.eye(3, dtype=int)):
        at = np.argwhere(place[:n, :n, :n] >= 0)
        corners = [at]
        for step in way:
            corners.append(corners[-1] + step)
        cells.append(np.column_stack([place[tuple(corner.T)] for corner in corners]))
    inner = ((points > 0) & (points < 1)).all(axis=1)
    cells = wound(points, np.concatenate(cells))
    points[inner] += rng.uniform(-jitter, jitter, (inner.sum(), 3)) / n
    return points, cells


def cube(nodes, seed=0):
    """(points, cells) of a random Delaunay cube: even boundary, random nodes inside; flat cells are left out."""
    rng = np.random.default_rng(seed)
    k = max(2, round(nodes ** (1 / 3)))
    line = np.linspace(0, 1, k)
    grid = np.stack(np.meshgrid(line, line, line, indexing="ij"), -1).reshape(-1, 3)
    on = ((grid == 0) | (grid == 1)).any(1)
    inside = rng.random((max(1, nodes - int(on.sum())), 3)) * (1 - 1 / k) + 0.5 / k
    points = np.concatenate([grid[on], inside])
    cells = Delaunay(points, qhull_options="QJ").simplices
    keep = np.abs(volumes6(points, cells)) > 1e-9
    return points, wound(points, cells[keep])


def ball(rng, around, off=0.4, stretch=(1.0, 1.0, 1.0)):
    """(points, cells) of one free node, 0, in a star of ``around`` nodes: the hull of random points about it."""
    ring = rng.normal(size=(max(around, 4), 3))
    ring[:4] = [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]
    ring /= np.linalg.norm(ring, axis=1)[:, None]
    hull = ConvexHull(ring)
    points = np.vstack([[0.0, 0.0, 0.0], ring])
    cells = wound(points, np.column_stack([np.zeros(len(hull.simplices), dtype=int), hull.simplices + 1]))
    points[0] = off * rng.uniform(-0.5, 0.5, 3)
    return points * np.asarray(stretch), cells


def globe(nodes, seed=0):
    """(points, cells) of a Delaunay ball: random nodes on the unit sphere and inside; flat cells are left out."""
    rng = np.random.default_rng(seed)
    outer = rng.normal(size=(4 * round(nodes ** (2 / 3)), 3))
    inner = rng.uniform(-1, 1, (3 * nodes, 3))
    inner = inner[np.linalg.norm(inner, axis=1) < 0.85][:nodes]
    points = np.vstack([outer / np.linalg.norm(outer, axis=1)[:, None], inner])
    cells = Delaunay(points).simplices
    return points, wound(points, cells[np.abs(volumes6(points, cells)) > 1e-7])


def integers(points, number=Fraction):
    """Coordinates as whole numbers of one common unit, as an object array. number: how a float is to be read."""
    rows = np.asarray(points)[:, :3]
    numbers, _ = whole(number(v) for v in rows.ravel().tolist())
    return np.array(numbers, dtype=object).reshape(rows.shape)


def as_written(value):
    """The shortest decimal that a file keeps of a float64."""
    return Fraction(repr(value))


def exact_measures(points, cells, orientation=1, number=Fraction):
    """(D, S) of each cell: six times the volume in its orientation, and the sum of the squared edges, exactly.

    In units of their own: cubes and squares of one length.
    """
    at = integers(points, number)
    cells = np.asarray(cells)
    a, b, c = (at[cells[:, k]] - at[cells[:, 0]] for k in (1, 2, 3))
    cross = np.stack(
        [b[:, 1] * c[:, 2] - b[:, 2] * c[:, 1], b[:, 2] * c[:, 0] - b[:, 0] * c[:, 2],
         b[:, 0] * c[:, 1] - b[:, 1] * c[:, 0]], axis=1,
    )  # fmt: skip
    double = (a * cross).sum(axis=1) * np.asarray(orientation, dtype=object)
    lengths = sum(((at[cells[:, i]] - at[cells[:, j]]) ** 2).sum(axis=1) for i, j in combinations(range(4), 2))
    return double, lengths


def exact_shapes(points, cells, orientation=1, number=Fraction):
    """D·|D|/S³ of each cell, exactly: 432 times it is η³ with the sign of the volume; 0 for cells without extent."""
    double, lengths = exact_measures(points, cells, orientation, number)
    return [Fraction(d * abs(d), s**3) if s else Fraction(0) for d, s in zip(double, lengths, strict=True)]


def exact_signs(points, cells, orientation=1):
    """The sign of each volume in its orientation."""
    double, _ = exact_measures(points, cells, orientation)
    return [(d > 0) - (d < 0) for d in double]


def measures(points, cells):
    """Columns of each cell, by their definitions in numpy: least and largest dihedral angle, η, scaled Jacobian, V."""
    rows = []
    for cell in np.asarray(cells):
        p = np.asarray(points, float)[cell]
        double = float(np.linalg.det(p[1:] - p[0]))
        edges = {pair: p[pair[1]] - p[pair[0]] for pair in combinations(range(4), 2)}
        squares = sum(float(e @ e) for e in edges.values())
        angles = []
        for (i, j), edge in edges.items():
            k, m = (n for n in range(4) if n not in (i, j))
            along = edge / np.linalg.norm(edge)
            u, v = (p[n] - p[i] - ((p[n] - p[i]) @ along) * along for n in (k, m))
            angles.append(math.degrees(math.atan2(np.linalg.norm(np.cross(u, v)), u @ v)))
        corner = [math.prod(np.linalg.norm(edge) for pair, edge in edges.items() if node in pair) for node in range(4)]
        shape = math.copysign(12 * (abs(double) / 2) ** (2 / 3) / squares, double)
        rows.append((min(angles), max(angles), shape, math.sqrt(2) * double / max(corner), double / 6))
    return np.array(rows).T.reshape(5, -1)


def turns(nodes):
    """Whether a facet, as its nodes are listed, is an even permutation of them in rising order."""
    return sum(a > b for a, b in combinations(nodes, 2)) % 2 == 0


def facets_of(cells):
    """Facet → [(cell, which of its facets, whether it is seen as an even permutation)]."""
    found = defaultdict(list)
    for t, cell in enumerate(np.asarray(cells).tolist()):
        for k, facet in enumerate(FACETS):
            nodes = [cell[i] for i in facet]
            found[tuple(sorted(nodes))].append((t, k, turns(nodes)))
    return found


def parts_of(cells):
    """The part of each cell, its orientation to be read consistently, and, by part, whether that is possible.

    A flood over the facets that exactly two cells share; the first cell of a part has +1.
    """
    cells = np.asarray(cells)
    beside = defaultdict(list)
    for seen in facets_of(cells).values():
        if len(seen) == 2:
            (t, _, one), (u, _, other) = seen
            beside[t].append((u, one == other))
            beside[u].append((t, one == other))
    part, orientation, consistent = [-1] * len(cells), [1] * len(cells), []
    for seed in range(len(cells)):
        if part[seed] >= 0:
            continue
        part[seed], stack = len(consistent), [seed]
        consistent.append(True)
        while stack:
            t = stack.pop()
            for u, turned in beside[t]:
                wanted = -orientation[t] if turned else orientation[t]
                if part[u] < 0:
                    part[u], orientation[u] = part[t], wanted
                    stack.append(u)
                elif orientation[u] != wanted:
                    consistent[part[t]] = False
    return part, orientation, consistent


def is_sphere(triangles):
    """Is a set of triangles connected over common edges, closed, and of Euler characteristic 2?"""
    edges = Counter(frozenset(e) for t in triangles for e in combinations(t, 2))
    nodes = {v for t in triangles for v in t}
    if any(n != 2 for n in edges.values()) or any(len(set(t)) != 3 for t in triangles):
        return False
    reached, stack = {0}, [0]
    while stack:
        one = set(triangles[stack.pop()])
        for k, other in enumerate(triangles):
            if k not in reached and len(one & set(other)) >= 2:
                reached.add(k)
                stack.append(k)
    return len(reached) == len(triangles) and len(nodes) - len(edges) + len(triangles) == 2


def closed_balls(nodes, cells, regions=None):
    """Which nodes have cells around them that are one closed ball, of one region, seen from two sides at each facet.

    By part: whether it can be read consistently is asked of all of its nodes.
    """
    cells = np.asarray(cells).reshape(-1, 4)
    regions = np.zeros(len(cells), dtype=int) if regions is None else np.asarray(regions)
    part, _, consistent = parts_of(cells)
    good = np.ones(nodes, dtype=bool)
    for t, cell in enumerate(cells):
        good[cell] &= consistent[part[t]]
    for facet, seen in facets_of(cells).items():
        if len(seen) != 2 or regions[seen[0][0]] != regions[seen[1][0]]:
            good[list(facet)] = False
    for v in range(nodes):
        link = [tuple(n for n in cell if n != v) for cell in cells.tolist() if v in cell]
        good[v] = bool(good[v] and link and is_sphere(link))
    return good

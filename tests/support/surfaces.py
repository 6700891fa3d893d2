"""Surfaces in space for tests: facets of spheres, cylinders and solids of cubes, and what follows of them by loops."""

from __future__ import annotations

import math
from collections import defaultdict

import numpy as np
from scipy.spatial import ConvexHull

from gmsnet.constraints.facets import Facets
from gmsnet.constraints.on_surface import surface_of
from gmsnet.constraints.patches import patches_of
from gmsnet.constraints.sliding_in_space import SurfaceSliding, patches_to_slide_on
from gmsnet.topology.volume import Volume
from gmsnet.topology.wound import Wound
from support import volumes


def facets_of(rows, nodes, label=0, lines=(), marks=0, still=()):
    """As ``boundary_of`` gives them; label, marks: one, or one for each facet or line."""
    rows, lines = np.asarray(rows, dtype=np.int64), np.asarray(lines, dtype=np.int64).reshape(-1, 2)
    labels = np.broadcast_to(np.asarray(label, dtype=np.int64), len(rows)).copy()
    mask = np.zeros(nodes, dtype=bool)
    mask[list(still)] = True
    names = tuple((str(k),) for k in range(int(labels.max(initial=0)) + 1))
    line_marks = np.broadcast_to(np.asarray(marks, dtype=np.int64), len(lines)).copy()
    return Facets(rows, labels, names, lines, line_marks, mask)


def patches(points, rows, angle=30.0, may=None, **about):
    may = np.ones(len(points), dtype=bool) if may is None else may
    return patches_of(facets_of(rows, len(points), **about), points, angle, False, may)


def constraint(points, rows, angle=30.0, single=False, **about):
    """What kernels slide nodes on, by node ids."""
    found = patches(points, rows, angle, **about)
    return found, surface_of(found, points, np.arange(len(points), dtype=np.int32), single)


def sphere(count, seed=0):
    """(points, rows) of the hull of points spread evenly over the unit sphere, turned at random."""
    k = np.arange(count) + 0.5
    height, angle = 1.0 - 2.0 * k / count, math.pi * (1.0 + math.sqrt(5.0)) * k
    flat = np.sqrt(1.0 - height**2)
    points = np.column_stack([flat * np.cos(angle), flat * np.sin(angle), height]) @ turned(seed).T
    rows = ConvexHull(points).simplices.astype(np.int64)
    a, b, c = (points[rows[:, j]] for j in range(3))
    wrong = np.einsum("ij,ij->i", a, np.cross(b, c)) < 0
    rows[wrong] = rows[wrong][:, [0, 2, 1]]
    return points, rows


def turned(seed):
    """A rotation of space."""
    matrix = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    return matrix * np.sign(np.linalg.det(matrix))


def cylinder(around, along):
    """(points, rows) of a cylinder of radius 1 along z, with caps of one node in the middle and a ring at half way."""
    angle = 2.0 * np.pi * np.arange(around) / around
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    levels = [np.column_stack([ring, np.full(around, z)]) for z in np.linspace(0.0, 2.0, along + 1)]
    caps = [np.column_stack([0.5 * ring, np.full(around, z)]) for z in (0.0, 2.0)]
    points = np.vstack([*levels, *caps, [[0.0, 0.0, 0.0], [0.0, 0.0, 2.0]]])
    j, k = np.arange(around), (np.arange(around) + 1) % around

    def strip(low, high):
        return [np.column_stack([low + j, low + k, high + k]), np.column_stack([low + j, high + k, high + j])]

    base = (along + 1) * around
    rows = [part for level in range(along) for part in strip(level * around, (level + 1) * around)]
    rows += strip(base, 0) + strip(along * around, base + around)
    middle = base + 2 * around
    rows += [np.column_stack([np.full(around, middle), base + k, base + j])]
    rows += [np.column_stack([np.full(around, middle + 1), base + around + j, base + around + k])]
    return points, np.concatenate(rows)


def solid(n, keep=None, jitter=0.0, seed=0):
    """(points, cells, on): those of n³ cubes that are kept, six tetrahedra each, in a unit cube, thrown along their
    sides by up to jitter/n. keep: of the cubes (K, 3) bool. on: (N, 3) bool, is the node on a side across this axis?
    """
    points, cells = volumes.lattice(n)
    if keep is not None:
        used, cells = np.unique(cells[keep(np.floor(points[cells].mean(axis=1) * n).astype(int))], return_inverse=True)
        points, cells = points[used], cells.reshape(-1, 4)
    on = np.zeros(points.shape, dtype=bool)
    for facet, seen in volumes.facets_of(cells).items():
        if len(seen) == 1:
            on[list(facet)] |= np.ptp(points[list(facet)], axis=0) == 0
    shift = np.where(on, 0.0, np.random.default_rng(seed).uniform(-jitter, jitter, points.shape) / n)
    least = 0.02 / n**3
    while (low := volumes.volumes6(points + shift, cells) < least).any():
        shift[cells[low]] *= 0.6
    return points + shift, cells, on


def ell(at):
    """Of 6³ cubes, those of an L-shaped part."""
    return (at[:, 0] < 3) | (at[:, 1] < 3)


def boundary(cells):
    """(F, 3) facets of one cell."""
    return np.array([facet for facet, seen in volumes.facets_of(cells).items() if len(seen) == 1])


def sliding(mesh, angle=30.0, fixed=None):
    """(topology, SurfaceSliding) of a mesh of tetrahedra, as a call has them."""
    wound = Wound.of(mesh, fixed)
    facets, found = patches_to_slide_on(mesh, wound, None, angle, fixed)
    topology = Volume.made(wound, found.slides | found.curves.slides)
    return topology, SurfaceSliding.of(mesh, facets, found, topology.memory, topology.free)


def _is_tip(units, least):
    """Do all of these normals turn from their mean by an angle of this cosine or more?"""
    mean = units.sum(axis=0)
    return least > 0 and max(units @ mean) <= (least + 1e-12) * np.linalg.norm(mean)


class Twin:
    """Sharp edges, patches and sliding nodes of facets, by their definitions."""

    def __init__(self, facets, points, angle, may):
        self.owners = defaultdict(list)
        rows = facets.rows.tolist()
        for f, row in enumerate(rows):
            for k in range(3):
                self.owners[frozenset((row[k], row[(k + 1) % 3]))].append(f)
        lines = {frozenset(line): mark for line, mark in zip(facets.lines.tolist(), facets.line_marks, strict=True)}
        normal = [np.cross(points[b] - points[a], points[c] - points[a]) for a, b, c in rows]
        least = math.cos(math.radians(angle))

        def smooth(edge, owners):
            if len(owners) != 2 or edge in lines:
                return False
            f, g = owners
            one, two = np.linalg.norm(normal[f]), np.linalg.norm(normal[g])
            if facets.label[f] != facets.label[g] or not one or not two:
                return False
            return normal[f] @ normal[g] >= (least + 1e-12) * one * two

        self.sharp = {edge for edge, owners in self.owners.items() if not smooth(edge, owners)}
        self.part = list(range(len(rows)))
        for edge, owners in self.owners.items():
            if edge not in self.sharp:
                old, new = self.part[owners[0]], self.part[owners[1]]
                self.part = [new if part == old else part for part in self.part]
        still = set(np.flatnonzero(facets.still).tolist())
        still |= {v for edge, owners in self.owners.items() if len(owners) != 2 for v in edge}
        still |= {v for edge in lines if edge not in self.owners for v in edge}
        at = defaultdict(list)
        for edge in self.sharp:
            for v in edge:
                at[v].append(edge)
        able = set(np.flatnonzero(may).tolist()) - still
        around = defaultdict(list)
        for f, row in enumerate(rows):
            for v in row:
                around[v].append(normal[f] / (np.linalg.norm(normal[f]) or 1.0))
        self.tips = {v for v, units in around.items() if v not in at and _is_tip(np.array(units), least)}
        able -= self.tips
        self.slides = {v for row in rows for v in row if v not in at} & able
        self.through = {v for v in able if len(at[v]) == 2 and self._goes_on(v, at[v], facets, lines, points, least)}

    def _goes_on(self, v, edges, facets, lines, points, least):
        """Is it one curve on both sides of a node?"""
        about = [(sorted(facets.label[f] for f in self.owners[e]), lines.get(e, -1)) for e in edges]
        if about[0] != about[1]:
            return False
        (a,), (b,) = (edge - {v} for edge in edges)
        back, ahead = points[v] - points[a], points[b] - points[v]
        length = np.linalg.norm(back) * np.linalg.norm(ahead)
        return length > 0 and back @ ahead >= (max(least, 0.0) - 1e-12) * length

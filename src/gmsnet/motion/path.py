"""The way of nodes to their places, and by how much a boundary turns on it.

A body that moves as a whole goes along an arc: its middle on a straight line, about which it turns. All other nodes go
straight. How much a boundary turns at a node is told from its edges before and after.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy.sparse
from numpy.typing import NDArray

from gmsnet.motion.prescribed import Prescribed
from gmsnet.topology.topology import Topology

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]
Flags = NDArray[np.bool_]
Ints = NDArray[np.int32]

RIGID = 1e-6  # of the size of a body: by no more does one that moves as a whole miss its places


@dataclass(frozen=True, eq=False)
class Path:
    """By places in memory, x + iy in units of the run. start, end: (N,) of all nodes; turn: (N,) radians, as asked for.

    bodies: (N,) the number of the body that a node moves with as a whole, −1 of others. edges: (E, 2) the edges by
    which a boundary's rotation is told. sure: (N,) where it is.
    """

    start: Complex
    end: Complex
    turn: Floats
    bodies: NDArray[np.int32]
    edges: Ints
    sure: Flags

    @classmethod
    def of(cls, prescribed: Prescribed, topology: Topology, start: Floats, exponent: int) -> Path:
        """start: (N, 2) ``near_points``. exponent: of the mesh."""
        memory = topology.memory
        moved, turn = prescribed.moved[memory], prescribed.turn[memory]
        end = np.where(moved[:, None], np.ldexp(prescribed.places[memory], -exponent), start)
        edges = outline(topology, moved)
        sure = np.zeros(len(memory), dtype=bool)
        sure[edges] = True
        z, w = as_complex(start), as_complex(end)
        return cls(z, w, turn, _bodies(z, w, turn, moved, edges), edges, sure)

    def places(self, share: float) -> Complex:
        """(N,) where nodes are when a share of the way is done; all that are not moved where they were."""
        if share == 1.0:
            return self.end
        places: Complex = self.start + share * (self.end - self.start)
        for number in range(int(self.bodies.max(initial=-1)) + 1):
            own = self.bodies == number
            middle, to, angle = _rigid(self.start[own], self.end[own], self.turn[own])
            way = self.start[own] - middle
            rest = np.exp(-1j * angle) * (self.end[own] - to) - way
            places[own] = middle + share * (to - middle) + np.exp(1j * angle * share) * (way + share * rest)
        return places

    def turns(self, share: float) -> Floats:
        """(N,) radians: by how much the boundary has turned at its nodes then; as asked for where it is not told."""
        places, asked = self.places(share), share * self.turn
        a, b = self.edges.T
        turned = np.conj(self.start[b] - self.start[a]) * (places[b] - places[a])
        turned = np.where(turned == 0.0, 1.0, turned)
        turned /= np.abs(turned)
        sums = np.bincount(a, turned.real, len(places)) + np.bincount(b, turned.real, len(places)) + 0j
        sums += 1j * (np.bincount(a, turned.imag, len(places)) + np.bincount(b, turned.imag, len(places)))
        return _unwrapped(np.angle(sums), asked, self.edges, self.sure, places == self.start)


def as_complex(points: Floats) -> Complex:
    """(N, 2) as x + iy."""
    z: Complex = points[:, 0] + 1j * points[:, 1]
    return z


def as_points(z: Complex) -> Floats:
    """x + iy as (N, 2)."""
    return np.column_stack([z.real, z.imag])


def outline(topology: Topology, moved: Flags) -> Ints:
    """(E, 2) edges of boundaries by places in memory; of nodes that are moved and on no boundary, those that join them.

    Edges between held nodes that are no boundary, such as across a gap of one cell, do not count but for those nodes.
    """
    from gmsnet.untangle.crossings import held_edges

    rim, every = held_edges(topology)
    known = np.zeros(len(topology.memory), dtype=bool)
    known[rim] = True
    inner = every[(moved[every] & ~known[every]).any(axis=1) & moved[every].all(axis=1)]
    return np.concatenate([rim, inner])


def _rigid(start: Complex, end: Complex, turn: Floats) -> tuple[complex, complex, float]:
    """The middles before and after, and the angle of the best rotation between, next to what is asked for."""
    middle, to = complex(start.mean()), complex(end.mean())
    asked = float(turn.mean())
    product = complex((np.conj(start - middle) * (end - to)).sum())
    rest = np.angle(product * np.exp(-1j * asked)) if product else 0.0
    return middle, to, asked + float(rest)


def _parts(edges: Ints, count: int) -> NDArray[np.int32]:
    graph = scipy.sparse.csr_array(
        (np.ones(len(edges), dtype=np.int8), (edges[:, 0], edges[:, 1])), shape=(count, count)
    )
    part: NDArray[np.int32] = scipy.sparse.csgraph.connected_components(graph, directed=False)[1]
    return part


def _bodies(start: Complex, end: Complex, turn: Floats, moved: Flags, edges: Ints) -> NDArray[np.int32]:
    """(N,) numbers of the connected parts of boundaries that are moved as a whole, −1 for all else."""
    bodies = np.full(len(start), -1, dtype=np.int32)
    part, count = _parts(edges, len(start)), 0
    for number in np.unique(part[edges[:, 0]]):
        own = np.flatnonzero(part == number)
        if not moved[own].all() or len(own) < 2:
            continue
        middle, to, angle = _rigid(start[own], end[own], turn[own])
        way = start[own] - middle
        if np.abs(np.exp(1j * angle) * way - (end[own] - to)).max() <= RIGID * np.abs(way).max():
            bodies[own] = count
            count += 1
    return bodies


def _unwrapped(angle: Floats, asked: Floats, edges: Ints, sure: Flags, still: Flags) -> Floats:
    """Angles without jumps by full turns along edges; each part next to what is asked for, or to 0 where it is still."""
    count, full = len(angle), 2.0 * math.pi
    out, part = np.where(sure, angle, asked), _parts(edges, len(angle))
    graph = scipy.sparse.csr_array(
        (np.ones(len(edges), dtype=np.int8), (edges[:, 0], edges[:, 1])), shape=(count, count)
    )
    own, first = np.unique(np.where(sure, part, -1), return_index=True)
    for number, root in zip(own.tolist(), first.tolist(), strict=True):
        if number < 0:
            continue
        order, before = scipy.sparse.csgraph.breadth_first_order(graph, root, directed=False)
        for node in order[1:].tolist():
            gap = out[before[node]] - out[node]
            out[node] += full * round(gap / full)
        anchors = order[still[order]]
        anchors = anchors if len(anchors) else order
        out[order] += full * np.round((asked[anchors] - out[anchors]).mean() / full)
    return out

"""The way of nodes to their places, and by how much a boundary turns on it.

A body that moves as a whole goes along an arc: its middle on a straight line, about which it turns. All other nodes go
straight. How much a boundary turns at a node is told from its edges before and after.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse
from numpy.typing import NDArray

from gmsnet.motion.prescribed import Prescribed
from gmsnet.topology.topology import Topology

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]
Flags = NDArray[np.bool_]
Ints = NDArray[np.int32]
Nodes = NDArray[np.integer[Any]]

RIGID = 1e-6  # of the size of a body: by no more does one that moves as a whole miss its places


class Body(NamedTuple):
    """A part of the boundary that moves as a whole: its nodes, their mean before and after, and the angle of its turn.

    way: of its nodes from the mean, before; rest: what they miss when they are turned, before that.
    """

    nodes: Nodes
    middle: complex
    to: complex
    angle: float
    way: Complex
    rest: Complex


@dataclass(frozen=True, eq=False)
class Path:
    """By places in memory, x + iy in units of the run. start, end: (N,) of all nodes; turn: (N,) radians, as asked for.

    bodies: the parts that move as a whole. edges: (E, 2) the edges by which a boundary's rotation is told. sure: (N,)
    where it is.
    """

    start: Complex
    end: Complex
    turn: Floats
    bodies: tuple[Body, ...]
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
        for nodes, middle, to, angle, way, rest in self.bodies:
            places[nodes] = middle + share * (to - middle) + np.exp(1j * angle * share) * (way + share * rest)
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
        return _unwrapped(np.angle(sums), asked, self.edges, places == self.start)


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


def _parts(edges: Ints, count: int) -> list[Nodes]:
    """The nodes of each connected part of a graph, without nodes that have no edge."""
    number = scipy.sparse.csgraph.connected_components(_graph(edges, count), directed=False)[1]
    nodes = np.unique(edges)
    order = np.argsort(number[nodes], kind="stable")
    nodes, number = nodes[order], number[nodes[order]]
    return np.split(nodes, np.flatnonzero(np.diff(number)) + 1) if len(nodes) else []


def _graph(edges: Ints, count: int) -> scipy.sparse.csr_array:
    ones = np.ones(len(edges), dtype=np.int8)
    return scipy.sparse.csr_array((ones, (edges[:, 0], edges[:, 1])), shape=(count, count))


def _bodies(start: Complex, end: Complex, turn: Floats, moved: Flags, edges: Ints) -> tuple[Body, ...]:
    """The connected parts of boundaries that are moved as a whole."""
    bodies = list[Body]()
    for own in _parts(edges[moved[edges].any(axis=1)], len(start)):
        if not moved[own].all():
            continue
        middle, to, asked = complex(start[own].mean()), complex(end[own].mean()), float(turn[own].mean())
        way = start[own] - middle
        product = complex((np.conj(way) * (end[own] - to)).sum()) * np.exp(-1j * asked)
        angle = asked + (float(np.angle(product)) if product else 0.0)
        rest = np.exp(-1j * angle) * (end[own] - to) - way
        if np.abs(rest).max() <= RIGID * np.abs(way).max():
            bodies.append(Body(own, middle, to, angle, way, rest))
    return tuple(bodies)


def _unwrapped(angle: Floats, asked: Floats, edges: Ints, still: Flags) -> Floats:
    """Angles without jumps by full turns along edges; each part next to what is asked for, or to 0 where it stays."""
    full, graph, out = 2.0 * math.pi, _graph(edges, len(angle)), asked.copy()
    for own in _parts(edges, len(angle)):
        order, before = scipy.sparse.csgraph.breadth_first_order(graph, int(own[0]), directed=False)
        out[order] = angle[order]
        for node in order[1:].tolist():
            out[node] += full * round((out[before[node]] - out[node]) / full)
        anchors = order[still[order]] if still[order].any() else order
        out[order] += full * np.round((asked[anchors] - out[anchors]).mean() / full)
    return out

"""The way of nodes to their places, and by how much a boundary turns on it.

A body that moves as a whole goes along an arc: its middle on a straight line, about which it turns. All other nodes go
straight. How much a boundary turns at a node is told from its edges before and after.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse
from numpy.typing import NDArray

from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.motion.prescribed import Prescribed
from gmsnet.motion.rotations import Rotations, rotations_in
from gmsnet.topology.outline import held_edges
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Ints = NDArray[np.int32]
Nodes = NDArray[np.integer[Any]]

FAR = 2.0**300  # units of the run: a boundary that goes farther never comes there, and squares must not overflow
RIGID = 1e-6  # of the size of a body: by no more does one that moves as a whole miss its places


class Body(NamedTuple):
    """A part of the boundary that moves as a whole: its nodes, their mean before and after, and its turn (k,).

    way: of its nodes from the mean, before; rest: what they miss when they are turned, before that.
    """

    nodes: Nodes
    middle: Floats
    to: Floats
    turn: Floats
    way: Floats
    rest: Floats


@dataclass(frozen=True, eq=False)
class Path:
    """By places in memory, in units of the run. start, end: (N, D) of all nodes; turn: (N, k) as asked for.

    bodies: the parts that move as a whole. edges: (E, 2) the edges by which a boundary's rotation is told. rotations:
    those of the dimension. sure: (N,) where a turn is told at the end.
    """

    start: Floats
    end: Floats
    turn: Floats
    bodies: tuple[Body, ...]
    edges: Ints
    rotations: Rotations
    sure: Flags

    @classmethod
    def of(
        cls, prescribed: Prescribed, topology: Topology | Volume, start: Floats, exponent: int,
        told: Flags | None = None,
    ) -> Path:  # fmt: skip
        """start: (N, D) ``near_points``. exponent: of the mesh. told: (N,) whose edges tell turns; None: all nodes."""
        memory = topology.memory
        moved, turn = prescribed.moved[memory], prescribed.turn[memory]
        with np.errstate(over="ignore"):
            end = np.where(moved[:, None], np.ldexp(prescribed.places[memory], -exponent), start)
        edges, rotations = outline(topology, moved), rotations_in(start.shape[1])
        edges = edges if told is None else edges[told[edges].all(axis=1)]
        _, sure = rotations.at_nodes(edges, _along(edges, start), _along(edges, end), len(start))
        bodies = _bodies(start, np.clip(end, -FAR, FAR), turn, moved, edges, rotations)
        return cls(start, end, turn, bodies, edges, rotations, sure)

    def places(self, share: float) -> Floats:
        """(N, D) where nodes are when a share of the way is done; all that are not moved where they were."""
        if share == 1.0:
            return self.end
        places: Floats = self.start + share * (self.end - self.start)
        for nodes, middle, to, turn, way, rest in self.bodies:
            places[nodes] = middle + share * (to - middle) + self.rotations.turned(way + share * rest, share * turn)
        return places

    def turns(self, share: float) -> Floats:
        """(N, k): by how much the boundary has turned at its nodes then; as asked for where it is not told."""
        places, asked = self.places(share), share * self.turn
        old, new = (_along(self.edges, each) for each in (self.start, places))
        found, told = self.rotations.at_nodes(self.edges, old, new, len(places))
        still = (places == self.start).all(axis=1)
        return _unwrapped(found, told, asked, self.edges, still, self.rotations)


def _along(edges: Ints, points: Floats) -> Floats:
    """(E, D) from the first to the second node of edges."""
    points = np.clip(points, -FAR, FAR)
    return np.asarray(points[edges[:, 1]] - points[edges[:, 0]])


def outline(topology: Topology | Volume, moved: Flags) -> Ints:
    """(E, 2) edges of boundaries by places in memory; of nodes that are moved and on no boundary, those that join them.

    Edges between held nodes that are no boundary, such as across a gap of one cell, do not count but for those nodes.
    """
    rim, every = held_edges(topology)
    known = np.zeros(len(topology.memory), dtype=bool)
    known[rim] = True
    inner = every[(moved[every] & ~known[every]).any(axis=1) & moved[every].all(axis=1)]
    return np.concatenate([rim, inner])


def _parts(edges: Ints, count: int) -> list[Nodes]:
    """The nodes of each connected part of a graph, without nodes that have no edge."""
    number = scipy.sparse.csgraph.connected_components(_graph(edges, count), directed=False)[1]
    nodes = sorted_unique(edges)
    order = np.argsort(number[nodes], kind="stable")
    nodes, number = nodes[order], number[nodes[order]]
    return np.split(nodes, np.flatnonzero(np.diff(number)) + 1) if len(nodes) else []


def _graph(edges: Ints, count: int) -> scipy.sparse.csr_array:
    ones = np.ones(len(edges), dtype=np.int8)
    return scipy.sparse.csr_array((ones, (edges[:, 0], edges[:, 1])), shape=(count, count))


def _bodies(
    start: Floats, end: Floats, turn: Floats, moved: Flags, edges: Ints, rotations: Rotations
) -> tuple[Body, ...]:
    """The connected parts of boundaries that are moved as a whole."""
    bodies = list[Body]()
    for own in _parts(edges[moved[edges].any(axis=1)], len(start)):
        if not moved[own].all():
            continue
        middle, to, asked = start[own].mean(axis=0), end[own].mean(axis=0), turn[own].mean(axis=0)
        way = start[own] - middle
        more, told = rotations.onto(rotations.turned(way, asked), end[own] - to)
        whole = rotations.joined(asked, more) if told else asked
        rest = rotations.turned(end[own] - to, -whole) - way
        if np.abs(rest).max() <= RIGID * np.abs(way).max():
            bodies.append(Body(own, middle, to, whole, way, rest))
    return tuple(bodies)


def _unwrapped(
    turns: Floats, told: Flags, asked: Floats, edges: Ints, still: Flags, rotations: Rotations
) -> Floats:  # fmt: skip
    """Turns without jumps by full turns along edges; each part next to what is asked for, or to none where it stays."""
    edges = edges[told[edges].all(axis=1)]
    graph, out, depth = _graph(edges, len(turns)), asked.copy(), np.zeros(len(turns), dtype=np.int32)
    out[told] = rotations.nearest(turns[told], asked[told])
    for own in _parts(edges, len(turns)):
        root = int(own[np.argmax(still[own])])
        order, before = scipy.sparse.csgraph.breadth_first_order(graph, root, directed=False)
        for node in order[1:].tolist():
            depth[node] = depth[before[node]] + 1
        levels = np.split(order, np.flatnonzero(np.diff(depth[order])) + 1)
        for level in levels[1:]:
            out[level] = rotations.nearest(out[level], out[before[level]])
        if rotations.k == 1:
            anchors = order[still[order]] if still[order].any() else order
            out[order] = rotations.nearest(out[order], out[order] + (asked[anchors] - out[anchors]).mean(axis=0))
    return out

"""How nodes inside follow a boundary that moves: each edge turns with its surroundings and keeps its length as it can.

Minimised is Σ w s |(y_j − y_i) − e^{iθ} (x_j − x_i)|² over the edges, θ the mean of the rotations at its two ends, and
w = 1/|x_j − x_i|²: relative changes count, so small cells near walls are the stiffest, and thin layers keep their
spacing. s is ten times as much in layers, and falls slowly with the distance from what moves. Rotations of the boundary
are known; inside they are harmonic at first (Zayer, Rössl, Karni, Seidel: Harmonic guidance for surface deformation,
Computer Graphics Forum 24, 2005). Then places and best rotations follow each other by turns (Sorkine, Alexa:
As-rigid-as-possible surface modeling, Symposium on Geometry Processing, 2007). Motions of all boundaries as one body
are reproduced but for rounding.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse
import scipy.spatial

from gmsnet.motion.path import Complex, Flags, Floats, Ints, as_points
from gmsnet.topology.topology import Topology
from gmsnet.untangle.harmonic import solver_of

ITERATIONS, SMALL_TURN = 12, 1e-3  # radians
TINY, FLAT = 1e-300, 1e-28  # FLAT: of the longest edge's square; shorter edges count as that long
IN_LAYERS = 10.0  # times as stiff
REACH = 0.5  # of the extent of what moves: at this distance from it edges are 1/√2 times as stiff


@dataclass(frozen=True, eq=False)
class Follower:
    """edges: (E, 2) of all cells with a free node, diagonals of quads too, by places in memory. free: (N,) bool.

    layers: (E,) those within layers and near refined walls. stiffness: (E,) beside what follows from their lengths.
    """

    edges: Ints
    free: Flags
    layers: Flags
    stiffness: Floats

    @classmethod
    def of(cls, topology: Topology, points: Complex, moving: Flags, kept: Flags) -> Follower:
        """Of the free nodes of a topology. moving: (N,) held nodes that go elsewhere. kept: (N,) of layers."""
        rows = topology.near
        edges = np.sort(np.concatenate([rows[:, [0, 1]], rows[:, [0, 2]], rows[:, [1, 2]]]), axis=1)
        edges = edges[topology.near_free[edges].any(axis=1)]
        key = np.unique(edges[:, 0].astype(np.int64) * len(topology.memory) + edges[:, 1])
        edges = np.column_stack(np.divmod(key, len(topology.memory))).astype(np.int32)
        layers = (kept | ~topology.near_free)[edges].all(axis=1) & kept[edges].any(axis=1)
        at, bodies = as_points(points), as_points(points[moving if moving.any() else ~topology.near_free])
        away, _ = scipy.spatial.cKDTree(bodies).query(at)
        reach = max(REACH * float(np.ptp(bodies, axis=0).max()), TINY)
        stiffness = np.where(layers, IN_LAYERS, 1.0) / np.sqrt(1.0 + away[edges].mean(axis=1) / reach)
        return cls(edges, topology.near_free, layers, stiffness)

    def follow(
        self, points: Complex, turned: Floats, unturned: Complex, places: Complex, turns: Floats, sure: Flags
    ) -> tuple[Complex, Floats]:
        """The points when held nodes are at new places, and by how much the surroundings of each node have turned.

        points: (N,) as they are now, after surroundings have turned by ``turned`` (N,) radians. unturned: (E,) the ways
        along the edges that are to be kept, as they were before any rotation. places, turns: (N,) of held nodes. sure:
        (N,) where ``turns`` is known; of other held nodes it follows.
        """
        a, b = self.edges.T
        count, free = len(points), self.free
        if not free.any():
            return places, turns
        square = unturned.real**2 + unturned.imag**2
        weight = self.stiffness / np.maximum(square, max(FLAT * float(square.max()), TINY))
        matrix = scipy.sparse.csr_array((weight, (a, b)), shape=(count, count))
        matrix = matrix + matrix.T
        rows = np.flatnonzero(free)
        inner = matrix[rows]
        diagonal = np.bincount(a, weight, count) + np.bincount(b, weight, count)
        solve = solver_of(scipy.sparse.diags_array(diagonal[rows], format="csc") - inner[:, rows].tocsc())
        turn = np.where(free, turned, turns)
        shift = np.where(free, 0.0, turn - turned)
        turn[rows] += solve(inner @ shift)
        refit, new = free | ~sure, np.where(free, points, places)
        for _ in range(ITERATIONS):
            wanted = np.exp(0.5j * (turn[a] + turn[b])) * unturned
            pull = weight * (wanted - (new[b] - new[a]))
            rest = _at_nodes(a, b, -pull, pull, count)[rows]
            shift = solve(np.column_stack([rest.real, rest.imag]))
            new[rows] += shift[:, 0] + 1j * shift[:, 1]
            fit = weight * np.conj(unturned) * (new[b] - new[a])
            more = np.where(refit, np.angle(_at_nodes(a, b, fit, fit, count) * np.exp(-1j * turn)), 0.0)
            if np.abs(more).max(initial=0.0) < SMALL_TURN:
                break
            turn += more
        return new, turn


def _at_nodes(a: Ints, b: Ints, of_a: Complex, of_b: Complex, count: int) -> Complex:
    """(count,) sums of values of edges at their two ends."""
    parts = [
        np.bincount(a, of_a_part, count) + np.bincount(b, of_b_part, count)
        for of_a_part, of_b_part in ((of_a.real, of_b.real), (of_a.imag, of_b.imag))
    ]
    sums: Complex = parts[0] + 1j * parts[1]
    return sums

"""One curve of Gmsh's geometry: places on it, nearest places, tangents."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

Floats = NDArray[np.float64]
BETWEEN = 8  # places that are known of the curve between the parameters of two nodes
LEAST = 64  # places in all
STEPS = 20  # at most so many to a nearest place; each takes the error to its square, times the curvature


class CadCurve:
    """Of the current model, by its tag.

    Gmsh's own ``getClosestPoint`` is not asked: it gives no parameters of curves (4.15), and places far away of splines
    where no place is orthogonal to the point.
    """

    def __init__(self, gmsh: Any, tag: int) -> None:
        self._model, self._tag = gmsh.model, tag
        low, high = gmsh.model.getParametrizationBounds(1, tag)
        self._low, self._high = float(low[0]), float(high[0])

    def at(self, parameters: Floats) -> Floats:
        """Places (K, 3)."""
        return np.asarray(self._model.getValue(1, self._tag, parameters), dtype=np.float64).reshape(-1, 3)

    def tangent(self, parameters: Floats) -> Floats:
        """Derivatives (K, 3)."""
        return np.asarray(self._model.getDerivative(1, self._tag, parameters), dtype=np.float64).reshape(-1, 3)

    def project(self, points: Floats) -> tuple[Floats, Floats]:
        """The nearest places (K, 3) to points (K, 3), and their parameters (K,). The ends count as places."""
        known, places, tree = self._known
        nearest = tree.query(points)[1]
        best, at = known[nearest], places[nearest]
        distance = np.linalg.norm(points - at, axis=1)
        parameters = best.copy()
        for _ in range(STEPS):
            along = self.tangent(parameters)
            square = np.maximum((along * along).sum(axis=1), np.finfo(float).tiny)
            step = ((points - self.at(parameters)) * along).sum(axis=1) / square
            parameters = np.clip(parameters + step, self._low, self._high)
            tried = self.at(parameters)
            off = np.linalg.norm(points - tried, axis=1)
            nearer = off < distance
            if not nearer.any():
                break
            best, at = np.where(nearer, parameters, best), np.where(nearer[:, None], tried, at)
            distance = np.minimum(off, distance)
        return at, best

    @cached_property
    def _known(self) -> tuple[Floats, Floats, cKDTree]:
        """Parameters of places along the curve, the places, and a tree of them."""
        _, _, own = self._model.mesh.getNodes(1, self._tag, False, True)
        inside = np.asarray(own)[(np.asarray(own) > self._low) & (np.asarray(own) < self._high)]
        ends = np.unique(np.concatenate([np.linspace(self._low, self._high, LEAST // BETWEEN + 1), inside]))
        share = np.arange(BETWEEN) / BETWEEN
        known = np.append((ends[:-1, None] + share * np.diff(ends)[:, None]).ravel(), self._high)
        places = self.at(known)
        return known, places, cKDTree(places)

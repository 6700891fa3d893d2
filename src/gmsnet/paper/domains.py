"""Good meshes of the airfoil and the pipe, before they are disturbed.

The paper had them from meshing software. What it prints of them after smoothing says what they were like: means of .94
and .96 in 1/q_V, so nearly all of their nodes have six triangles; and greatest angles of 111° and 112° after Laplacian
smoothing and of 96° and 94° after GETMe. The meshes below, were they without nodes of degree four, would come down to
82° with Laplacian smoothing. So the paper's have a few, as meshing software leaves them; here as many edges are split.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from gmsnet.generate import Curve, good_mesh, settle, split_edges
from gmsnet.mesh.mesh import Mesh

Floats = NDArray[np.float64]

ARC = 200  # points of a curved boundary
SWEEPS = 20  # of Laplacian smoothing at the end

FOIL_EDGE, FOIL_GROWTH = 0.025, 0.13  # chords: length of edges on the airfoil, and what it grows by with the distance
FARFIELD = 3.0  # chords
FOIL_DEGREE_FOUR = 6

PIPE_EDGE = 1.0 / 14.0  # pipe widths
PIPE_DEGREE_FOUR = 6


@cache
def airfoil() -> Mesh:
    """NACA 0012 in a round far field: markers "airfoil" and "farfield"; edges grow with the distance from the foil."""
    upper = naca0012()
    lower = (upper * [1.0, -1.0])[::-1]
    tree = cKDTree(np.concatenate([upper, lower]))

    def size(points: Floats) -> Floats:
        return np.asarray(FOIL_EDGE + FOIL_GROWTH * tree.query(points)[0])

    turn = np.linspace(0.0, 2.0 * np.pi, 4 * ARC)
    circle = [0.5, 0.0] + FARFIELD * np.column_stack([np.cos(turn), np.sin(turn)])
    rings = [[Curve(circle, "farfield")], [Curve(upper, "airfoil"), Curve(lower, "airfoil")]]
    return _as_software_leaves_it(good_mesh(rings, size), FOIL_DEGREE_FOUR)


@cache
def pipe() -> Mesh:
    """A pipe of width 1 that turns by 90°: markers "inlet", "outlet" and "wall"; edges of one length."""
    turn = np.linspace(0.0, np.pi / 2.0, ARC)
    inside, outside, straight = 0.6, 1.6, 1.2

    def wall(radius: float) -> Floats:
        bend = radius * np.column_stack([np.sin(turn), -np.cos(turn)])
        return np.concatenate([[[-straight, -radius]], bend, [[radius, straight]]])

    outer, inner = wall(outside), wall(inside)[::-1]
    ring = [
        Curve(outer, "wall"),
        Curve(np.array([outer[-1], inner[0]]), "outlet"),
        Curve(inner, "wall"),
        Curve(np.array([inner[-1], outer[0]]), "inlet"),
    ]
    return _as_software_leaves_it(good_mesh([ring], PIPE_EDGE), PIPE_DEGREE_FOUR)


def naca0012() -> Floats:
    """The upper side of the airfoil from its nose (0, 0) to its tail (1, 0), (ARC × 2).

    y = 0.6·(0.2969√x − 0.1260x − 0.3516x² + 0.2843x³ − 0.1036x⁴), the thickness of NACA's four-digit airfoils (NACA
    Report 460, 1933) with the last coefficient that closes the tail.
    """
    x = 0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, ARC)))
    y = 0.6 * (0.2969 * np.sqrt(x) - 0.1260 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1036 * x**4)
    y[-1] = 0.0
    return np.column_stack([x, y])


def _as_software_leaves_it(mesh: Mesh, degree_four: int) -> Mesh:
    """With a few nodes of degree four, and smoothed."""
    return settle(split_edges(mesh, degree_four), SWEEPS)

"""Movers of meshes as others have them, for comparison: linear elasticity, radial basis functions, a Laplacian.

Each takes points (N, D), cells (in the plane triangles (T, 3) and quads (Q, 4), in space tetrahedra (T, 4)), which
nodes have places prescribed, and these; and returns new points. None looks at whether cells are inverted.
"""

from __future__ import annotations

import math

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as linear
from scipy.interpolate import RBFInterpolator
from scipy.spatial import cKDTree

GAUSS = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) / np.sqrt(3.0)
POISSON = 0.3


def in_steps(mover, steps):
    """The same mover in equal steps, each from the mesh after the last one, as SU2 makes them."""

    def moved(points, cells, known, places):
        start = points
        for step in range(1, steps + 1):
            points = mover(points, cells, known, start + (places - start) * step / steps)
        return points

    return moved


def gradients(points, nodes):
    """Gradients of the linear or bilinear shape functions (G, C, n, D) at Gauss points, and their shares (G, C)."""
    x, dimension = points[nodes], points.shape[1]
    if nodes.shape[1] == dimension + 1:
        local = np.vstack([-np.ones(dimension), np.eye(dimension)])[None]
        weight = 1.0 / math.factorial(dimension)
    else:
        sign = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
        local = np.stack([0.25 * sign * (1 + sign * at)[:, ::-1] for at in GAUSS])
        weight = 1.0
    jacobian = np.einsum("gni,cnj->gcij", local, x)
    area = np.linalg.det(jacobian)
    inverse = np.linalg.inv(np.where(np.abs(area)[..., None, None] > 1e-300, jacobian, np.eye(dimension)))
    return np.einsum("gcij,gnj->gcni", inverse, local), weight * area


def elasticity(points, cells, known, places):
    """Linear elasticity, in the plane of plane strain, the stiffness of a cell the inverse of its area or volume: SU2's
    DEFORM_MESH.

    Source: T. D. Economon, F. Palacios, S. R. Copeland, T. W. Lukaczyk, J. J. Alonso, "SU2: An open-source suite for
    multiphysics simulation and design", AIAA Journal 54(3), 2016; DEFORM_STIFFNESS_TYPE= INVERSE_VOLUME.
    """
    dimension = points.shape[1]
    count = dimension * len(points)
    rows, columns, values = [], [], []
    for nodes in cells:
        if not len(nodes):
            continue
        slope, area = gradients(points, nodes)
        stiffness = 1.0 / np.maximum(np.abs(area).sum(axis=0), 1e-300)
        mu = stiffness / (2.0 * (1.0 + POISSON))
        lame = stiffness * POISSON / ((1.0 + POISSON) * (1.0 - 2.0 * POISSON))
        weight = np.abs(area)
        both = np.einsum("gc,gcai,gcbj->caibj", weight, slope, slope)
        dot = np.einsum("gc,gcak,gcbk->cab", weight, slope, slope)
        block = lame[:, None, None, None, None] * both
        block = block + mu[:, None, None, None, None] * both.transpose(0, 1, 4, 3, 2)
        block = (
            block + mu[:, None, None, None, None] * dot[:, :, None, :, None] * np.eye(dimension)[None, None, :, None, :]
        )
        size = dimension * nodes.shape[1]
        unknown = (dimension * nodes[:, :, None] + np.arange(dimension)).reshape(len(nodes), size)
        rows.append(np.repeat(unknown, size, axis=1).ravel())
        columns.append(np.tile(unknown, (1, size)).ravel())
        values.append(block.reshape(len(nodes), -1).ravel())
    matrix = sp.csr_array(
        (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=(count, count)
    )
    held = np.repeat(known, dimension)
    shift = solved(matrix, held, (places - points).ravel())
    return points + shift.reshape(-1, dimension)


def laplacian(points, cells, known, places):
    """Δu = 0 for the displacement, the diffusivity one over the squared distance from what is moved.

    So OpenFOAM's displacementLaplacian with ``quadratic inverseDistance``, by linear and bilinear elements.
    """
    moved = known & (places != points).any(axis=1)
    distance, _ = cKDTree(points[moved]).query(points)
    rows, columns, values = [], [], []
    for nodes in cells:
        if not len(nodes):
            continue
        slope, area = gradients(points, nodes)
        away = np.maximum(distance[nodes].mean(axis=1), 1e-9)
        block = np.einsum("gc,gcak,gcbk->cab", np.abs(area), slope, slope) / away[:, None, None] ** 2
        rows.append(np.repeat(nodes, nodes.shape[1], axis=1).ravel())
        columns.append(np.tile(nodes, (1, nodes.shape[1])).ravel())
        values.append(block.ravel())
    matrix = sp.csr_array(
        (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=(len(points),) * 2
    )
    return points + solved(matrix, known, places - points)


def radial_basis(points, cells, known, places):
    """Thin-plate splines of the displacement through all nodes with a place prescribed.

    Source: A. de Boer, M. S. van der Schoot, H. Bijl, "Mesh deformation based on radial basis function interpolation",
    Computers and Structures 85, 2007.
    """
    used = np.zeros(len(points), dtype=bool)
    for nodes in cells:
        used[nodes] = True
    out, inner = np.where(known[:, None], places, points), used & ~known
    spline = RBFInterpolator(points[known & used], (places - points)[known & used], kernel="thin_plate_spline")
    out[inner] += spline(points[inner])
    return out


def solved(matrix, held, values):
    """Ax = 0 for the rows that are not held, x as given where they are."""
    free = np.flatnonzero(~held & (np.asarray(abs(matrix).sum(axis=1)).ravel() > 0.0))
    out = np.where(held.reshape(-1, *[1] * (values.ndim - 1)), values, 0.0)
    rows = matrix[free]
    out[free] = linear.splu(rows[:, free].tocsc()).solve(-(rows @ out))
    return out


MOVERS = {
    "elasticity, 1 step": elasticity,
    "elasticity, 10 steps": in_steps(elasticity, 10),
    "Laplacian": laplacian,
    "radial basis": radial_basis,
}

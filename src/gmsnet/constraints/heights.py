"""The height of a surface over a chart, as its nodes tell it: quadratics through those nearby."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.features import dot

Floats = NDArray[np.float64]
NEIGHBOURS = 16  # nodes through which a quadratic goes
NEAR = 0.05  # of the square of the reach: within it the weight of a node hardly grows
RIDGE = 1e-8  # of the weights, so that a quadratic through nodes on a conic is told, too


class Heights(NamedTuple):
    """At places of a chart: height (P,), slope (P, 2), and how far the nodes around are off the quadratic (P,)."""

    height: Floats
    slope: Floats
    off: Floats


def heights_at(places: Floats, nodes: Floats, height: Floats) -> Heights:
    """The heights at places (P, 2) of a chart, from nodes (n, 2) there and their heights (n,)."""
    from scipy.spatial import cKDTree  # it takes a tenth of a second to import

    count = min(NEIGHBOURS, len(nodes))
    far, which = (found.reshape(len(places), count) for found in cKDTree(nodes).query(places, k=count))
    reach = np.maximum(far[:, -1:] * (1.0 + NEAR), np.finfo(float).tiny)
    square = (far / reach) ** 2
    weight = (1.0 - square) ** 2 / (square + NEAR)
    weight /= weight.sum(axis=1, keepdims=True)
    u, v = ((nodes[which] - places[:, None]) / reach[..., None]).transpose(2, 0, 1)
    base = np.stack([np.ones_like(u), u, v, u * u, u * v, v * v], axis=2)
    middle = (weight * height[which]).sum(axis=1, keepdims=True)
    above = height[which] - middle
    matrix = np.einsum("pk,pki,pkj->pij", weight, base, base) + RIDGE * np.eye(6)
    found = np.linalg.solve(matrix, np.einsum("pk,pki,pk->pi", weight, base, above)[..., None])[..., 0]
    error = np.einsum("pki,pi->pk", base, found) - above
    off = np.sqrt((weight * error**2).sum(axis=1))
    return Heights(found[:, 0] + middle[:, 0], found[:, 1:3] / reach, off)


def within(places: Floats, triangles: Floats, limit: Floats) -> Floats:
    """Places (P, 3) as near to triangles (P, 3, 3) as they are to be (P,): on the way to the nearest point of these."""
    a, b, c = triangles.transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    square = dot(normal, normal)
    share = np.divide(dot(places - a, normal), square, out=np.zeros(len(places)), where=square > 0.0)
    foot, least = places - share[:, None] * normal, np.full(len(places), np.inf)
    inside = square > 0.0
    for p, q in ((a, b), (b, c), (c, a)):
        inside &= dot(np.cross(q - p, foot - p), normal) >= 0.0
    least[inside] = dot(foot - places, foot - places)[inside]
    for p, q in ((a, b), (b, c), (c, a)):
        length = dot(q - p, q - p)
        along = np.divide(dot(places - p, q - p), length, out=np.zeros(len(places)), where=length > 0.0)
        on_edge = p + np.clip(along, 0.0, 1.0)[:, None] * (q - p)
        away = dot(on_edge - places, on_edge - places)
        nearer = away < least
        foot[nearer], least[nearer] = on_edge[nearer], away[nearer]
    far = np.sqrt(least)
    share = np.minimum(1.0, np.divide(limit, far, out=np.ones(len(places)), where=far > 0.0))
    out: Floats = foot + share[:, None] * (places - foot)
    return out

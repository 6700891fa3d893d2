"""Dihedral angles of a tetrahedron seen from one of its nodes, with their gradients in that node.

With the spokes a, b, c, D = a·(b × c) > 0 and the outward normals of the four faces (twice their areas long)

    p = c × b,  q = a × c,  r = b × a  (opposite to the ends of a, b, c),  t = −(p + q + r)  (opposite to the node),

the angle at an edge e between the faces m and n is atan2(|e|·D, −m·n). As the node moves, that at the edge of a and b,
which does not have it, grows by r·|b − a|/|r|²: the face turns about the edge. So does the angle at the spoke a when
the end of b moves, by r·|a|/|r|², and when that of c does, by q·|a|/|q|². No angle changes when all four nodes are
shifted or turned together, so that in the node itself its gradient is

    −(1 − a·b/|a|²)·r·|a|/|r|² − (1 − a·c/|a|²)·q·|a|/|q|².
"""

from __future__ import annotations

import math

from gmsnet.kernels.jit.compile import inlined
from gmsnet.kernels.simplex.measures import angle


@inlined
def opposite_edge(double, edge, rx, ry, rz, tx, ty, tz):
    """The angle in radians at an edge without the node, and its gradient. edge: squared; r: of the face with the node.

    t: the face opposite to the node. double: D.
    """
    length = math.sqrt(edge)
    share = length / (rx * rx + ry * ry + rz * rz)
    return angle(double * length, -(rx * tx + ry * ty + rz * tz)), share * rx, share * ry, share * rz


@inlined
def at_spoke(double, a2, ab, ac, rx, ry, rz, qx, qy, qz):
    """The same at the spoke a. a2, ab, ac: products of the spokes."""
    length = math.sqrt(a2)
    to_r = (ab / a2 - 1.0) * length / (rx * rx + ry * ry + rz * rz)
    to_q = (ac / a2 - 1.0) * length / (qx * qx + qy * qy + qz * qz)
    turned = angle(double * length, -(rx * qx + ry * qy + rz * qz))
    return turned, to_r * rx + to_q * qx, to_r * ry + to_q * qy, to_r * rz + to_q * qz


@inlined
def dihedrals(ax, ay, az, bx, by, bz, cx, cy, cz):
    """D, and the six angles with their gradients: at the spokes a, b, c, and at the edges of a b, b c, c a."""
    px, py, pz = cy * bz - cz * by, cz * bx - cx * bz, cx * by - cy * bx
    qx, qy, qz = ay * cz - az * cy, az * cx - ax * cz, ax * cy - ay * cx
    rx, ry, rz = by * az - bz * ay, bz * ax - bx * az, bx * ay - by * ax
    tx, ty, tz = -(px + qx + rx), -(py + qy + ry), -(pz + qz + rz)
    double = -(ax * px + ay * py + az * pz)
    a2, b2, c2 = ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz, cx * cx + cy * cy + cz * cz
    ab, bc, ca = ax * bx + ay * by + az * bz, bx * cx + by * cy + bz * cz, cx * ax + cy * ay + cz * az
    return (
        double,
        at_spoke(double, a2, ab, ca, rx, ry, rz, qx, qy, qz),
        at_spoke(double, b2, bc, ab, px, py, pz, rx, ry, rz),
        at_spoke(double, c2, ca, bc, qx, qy, qz, px, py, pz),
        opposite_edge(double, a2 + b2 - 2.0 * ab, rx, ry, rz, tx, ty, tz),
        opposite_edge(double, b2 + c2 - 2.0 * bc, px, py, pz, tx, ty, tz),
        opposite_edge(double, c2 + a2 - 2.0 * ca, qx, qy, qz, tx, ty, tz),
    )

"""Curves in space that nodes slide on: cubic pieces one after the other, each over a chord.

Functions are told no more of a surface than they need: all that is passed to a part is copied.
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import inlined, part

LONGEST_WALK = 100  # facets or pieces from one place to the next
NOWHERE = -1


@inlined
def along_piece(piece, p, x, y, z):
    """How far along the chord of a piece the foot of a point is: below 0 before its beginning, above 1 behind it."""
    ux, uy, uz = piece[p, 3, 0] - piece[p, 0, 0], piece[p, 3, 1] - piece[p, 0, 1], piece[p, 3, 2] - piece[p, 0, 2]
    square = ux * ux + uy * uy + uz * uz
    if not square > 0.0:
        return 0.0
    return ((x - piece[p, 0, 0]) * ux + (y - piece[p, 0, 1]) * uy + (z - piece[p, 0, 2]) * uz) / square


@part
def follow_curve(piece, before, after, p, x, y, z):
    """The piece nearest to a point, from piece p on, and how far along its chord, from 0 to 1."""
    way = 0
    for _ in range(LONGEST_WALK):
        t = along_piece(piece, p, x, y, z)
        if t < 0.0 and way <= 0 and before[p] != NOWHERE:
            p, way = before[p], -1
        elif t > 1.0 and way >= 0 and after[p] != NOWHERE:
            p, way = after[p], 1
        else:
            return p, min(max(t, 0.0), 1.0)
    return p, min(max(t, 0.0), 1.0)


@inlined
def on_piece(piece, p, k, t):
    """Coordinate k of the place on a piece: its very ends at 0 and 1."""
    r = 1.0 - t
    ends = r * r * r * piece[p, 0, k] + t * t * t * piece[p, 3, k]
    return ends + 3.0 * r * t * (r * piece[p, 1, k] + t * piece[p, 2, k])


@part
def piece_tangent(piece, p, t):
    """The unit tangent of a piece."""
    r = 1.0 - t
    x = r * r * (piece[p, 1, 0] - piece[p, 0, 0]) + 2.0 * r * t * (piece[p, 2, 0] - piece[p, 1, 0])
    y = r * r * (piece[p, 1, 1] - piece[p, 0, 1]) + 2.0 * r * t * (piece[p, 2, 1] - piece[p, 1, 1])
    z = r * r * (piece[p, 1, 2] - piece[p, 0, 2]) + 2.0 * r * t * (piece[p, 2, 2] - piece[p, 1, 2])
    x += t * t * (piece[p, 3, 0] - piece[p, 2, 0])
    y += t * t * (piece[p, 3, 1] - piece[p, 2, 1])
    z += t * t * (piece[p, 3, 2] - piece[p, 2, 2])
    length = np.sqrt(x * x + y * y + z * z)
    if not length > 0.0:
        return 1.0, 0.0, 0.0
    return x / length, y / length, z / length

"""Nodes that slide: the tangent of a node's curve, and the place on the curve nearest to where a node would go.

A curve is a chain of pieces, each a circular arc or a segment (kernels.star.arcs).

The parameter of a node is the number of its piece on the curve plus t; on a closed curve of n pieces it lies in [0, n).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import inlined, kernel, part
from gmsnet.kernels.star.arcs import piece_parameter, piece_point, piece_tangent

ARCS, LINE, SAME_X, SAME_Y = range(4)  # kinds of curves; nodes of the last two keep the very bits of a coordinate
WAY = 0.9  # of the way to the next node on the curve is the most that a node goes in one move


class Constraint(NamedTuple):
    """The curves that nodes slide on, and where on them they are; nodes by places in memory.

    row: (N,) int32, the row of each node that is an inner one of a curve, else −1. By rows (R,): curve int32; before,
    after int32, the rows of its neighbours on the curve, −1 where that is an end of the curve; parameter float64, which
    changes as nodes move: what keeps points for later keeps a copy of it beside them. By curves (C,): kind int8; closed
    bool; first (C + 1,) int64, whose pieces are first[c] … first[c + 1] − 1. piece: (P, 6) float64: P, Q, cos α, sin α.
    single: new coordinates are rounded to float32. cost: (P, 2) how much of what an edge may leave out is spent on each
    piece, and on those before it on its curve: an edge is as far off its curve as it may be where that is 1.
    """

    row: NDArray[np.int32]
    curve: NDArray[np.int32]
    before: NDArray[np.int32]
    after: NDArray[np.int32]
    parameter: NDArray[np.float64]
    kind: NDArray[np.int8]
    closed: NDArray[np.bool_]
    first: NDArray[np.int64]
    piece: NDArray[np.float64]
    single: bool
    cost: NDArray[np.float64]


@inlined
def piece_at(constraint, curve, u):
    """The row in ``piece`` of parameter u of a curve, and t. u may be outside of [0, n] on a closed curve."""
    first = constraint.first[curve]
    count = constraint.first[curve + 1] - first
    number = np.int64(np.floor(u))
    if constraint.closed[curve]:
        return first + number % count, u - number
    number = min(max(number, 0), count - 1)
    return first + number, u - number


@inlined
def limits(constraint, row):
    """Between which parameters a node must stay: those of its neighbours. On a closed curve unrolled around its own."""
    curve, u = constraint.curve[row], constraint.parameter[row]
    count = float(constraint.first[curve + 1] - constraint.first[curve])
    before, after = constraint.before[row], constraint.after[row]
    low = constraint.parameter[before] if before >= 0 else 0.0
    high = constraint.parameter[after] if after >= 0 else count
    if constraint.closed[curve]:
        low -= count if low >= u else 0.0
        high += count if high <= u else 0.0
    return low, high


@inlined
def nearest(constraint, curve, u, low, high, x, y):
    """The parameter of the place nearest to (x, y), sought from u on along the curve, no further than low and high.

    Normals of neighbouring pieces agree where they join, so a point behind the end of one is not before the beginning
    of the next, but for rounding.
    """
    number, way = np.floor(u), 0
    if number >= high:  # u is the end of a curve
        number -= 1.0
    while True:
        k, _ = piece_at(constraint, curve, number)
        t = piece_parameter(constraint.piece, k, x, y)
        if t < 0.0 and way <= 0 and number > low:
            number, way = number - 1.0, -1
        elif t > 1.0 and way >= 0 and number + 1.0 < high:
            number, way = number + 1.0, 1
        else:
            return number + min(max(t, 0.0), 1.0)


@inlined
def spent(constraint, curve, u):
    """What is spent from the beginning of a curve to parameter u, which may be outside of [0, n] on a closed one."""
    k, t = piece_at(constraint, curve, u)
    last = constraint.first[curve + 1] - 1
    rounds = 0.0
    if constraint.closed[curve]:
        rounds = np.floor(u / float(last + 1 - constraint.first[curve]))
    whole = constraint.cost[last, 0] + constraint.cost[last, 1]
    return rounds * whole + constraint.cost[k, 1] + t * constraint.cost[k, 0]


@inlined
def short_of(constraint, curve, u, v, other):
    """The parameter nearest to v, from u to v, up to which the edge to a neighbour at ``other`` is near enough to its
    curve, or no further from it than it was."""
    way = 1.0 if v > u else -1.0
    begin = spent(constraint, curve, other)
    excess = abs(spent(constraint, curve, v) - begin) - max(1.0, abs(spent(constraint, curve, u) - begin))
    while excess > 0.0 and (v - u) * way > 0.0:
        # Back to where this piece begins, or as far on it as is needed.
        edge = np.ceil(v) - 1.0 if way > 0.0 else np.floor(v) + 1.0
        k, _ = piece_at(constraint, curve, 0.5 * (edge + v))
        on_it = abs(v - edge) * constraint.cost[k, 0]
        if on_it >= excess:
            v -= way * excess / constraint.cost[k, 0]
            break
        v, excess = edge, excess - on_it
    return max(u, v) if way > 0.0 else min(u, v)


@part
def tangent_at(constraint, node):
    """The unit tangent of the curve at a node that has a row."""
    row = constraint.row[node]
    k, t = piece_at(constraint, constraint.curve[row], constraint.parameter[row])
    return piece_tangent(constraint.piece, k, t)


@part
def snap(constraint, node, x, y):
    """Where a node that has a row goes if it would go to (x, y): x, y, and its parameter there.

    It is the nearest place on the curve from where the node is, but no further than WAY of the way to either
    neighbour's parameter: nodes keep their order strictly, however often they move one after the other. Nodes that move
    at the same time must be no neighbours. Nor does an edge leave more of its curve out than it may. Nothing is stored.

    On a line, the place is P + t·(Q − P); on one along an axis, one coordinate is that of P, the other is kept.
    """
    row = constraint.row[node]
    curve, u = constraint.curve[row], constraint.parameter[row]
    low, high = limits(constraint, row)
    v = nearest(constraint, curve, u, low, high, x, y)
    least, most = u - WAY * (u - low), u + WAY * (high - u)
    cut = v < least or v > most
    v = min(max(v, least), most)
    if constraint.kind[curve] == ARCS and v != u:
        v = short_of(constraint, curve, u, v, low if v > u else high)
    if not low < v < high:  # no float is left between the neighbours
        v, cut = u, True
    k, t = piece_at(constraint, curve, v)
    kind = constraint.kind[curve]
    px, py = piece_point(constraint.piece, k, t)
    if kind == SAME_X:
        px = constraint.piece[k, 0]
        py = py if cut else y
    elif kind == SAME_Y:
        py = constraint.piece[k, 1]
        px = px if cut else x
    if constraint.single:
        px, py = float(np.float32(px)), float(np.float32(py))
    if constraint.closed[curve]:
        count = float(constraint.first[curve + 1] - constraint.first[curve])
        v += count if v < 0.0 else 0.0
        v -= count if v >= count else 0.0
    return px, py, v


@inlined
def slides(constraint):
    """May any node slide?"""
    return constraint is not None


@part
def on_curve(constraint, node, x, y):
    """Where a node goes that would go to (x, y): there, or, if it slides, where ``snap`` says."""
    if constraint is None:
        return x, y
    if constraint.row[node] < 0:
        return x, y
    px, py, _ = snap(constraint, node, x, y)
    return px, py


@part
def follow(constraint, node, x, y):
    """Takes note that a node has gone to (x, y), a place on its curve if it slides."""
    if constraint is not None:
        row = constraint.row[node]
        if row >= 0:
            _, _, constraint.parameter[row] = snap(constraint, node, x, y)


@part
def along_curve(constraint, node, gx, gy, xx, xy, yy):
    """Gradient and Hessian for a step that, if the node slides, is Newton's along the tangent t of its curve.

    They become (g·t) t and (tᵀHt) I, whose step is (g·t)/(tᵀHt) t.
    """
    if constraint is not None and constraint.row[node] >= 0:
        tx, ty = tangent_at(constraint, node)
        slope = gx * tx + gy * ty
        bend = tx * (xx * tx + xy * ty) + ty * (xy * tx + yy * ty)
        return slope * tx, slope * ty, bend, 0.0 * xy, bend
    return gx, gy, xx, xy, yy


@kernel
def locate(constraint, points):
    """Writes the parameter of each node that has a row anew, from the coordinates (N, 2) that it has.

    For coordinates that were kept without their parameters. Sought along the curve from the parameter before, between
    the ends of the curve.
    """
    for node in range(len(constraint.row)):
        row = constraint.row[node]
        if row < 0:
            continue
        curve, u = constraint.curve[row], constraint.parameter[row]
        count = float(constraint.first[curve + 1] - constraint.first[curve])
        low, high = (u - 0.5 * count, u + 0.5 * count) if constraint.closed[curve] else (0.0, count)
        v = nearest(constraint, curve, u, low, high, points[node, 0], points[node, 1])
        if constraint.closed[curve]:
            v += count if v < 0.0 else 0.0
            v -= count if v >= count else 0.0
        constraint.parameter[row] = v


@kernel
def land_all(constraint, nodes, points, tangents):
    """Puts these nodes (K,) of points (N, 2) to the nearest places on their curves; writes the tangents there (K, 2).

    Straight curves go on behind their ends, for these may have moved. No neighbour is in the way. Parameters are
    stored, those of places behind an end as of the end.
    """
    piece = constraint.piece
    for i in range(len(nodes)):
        node = nodes[i]
        x, y = points[node, 0], points[node, 1]
        row = constraint.row[node]
        curve, u = constraint.curve[row], constraint.parameter[row]
        kind, count = constraint.kind[curve], float(constraint.first[curve + 1] - constraint.first[curve])
        low, high = (u - 0.5 * count, u + 0.5 * count) if constraint.closed[curve] else (0.0, count)
        v = nearest(constraint, curve, u, low, high, x, y)
        k, t = piece_at(constraint, curve, v)
        if kind != ARCS:
            t = piece_parameter(piece, k, x, y)
        px, py = piece_point(piece, k, t)
        if kind == SAME_X:
            px, py = piece[k, 0], y
        elif kind == SAME_Y:
            px, py = x, piece[k, 1]
        if constraint.single:
            px, py = float(np.float32(px)), float(np.float32(py))
        points[node, 0], points[node, 1] = px, py
        tangents[i, 0], tangents[i, 1] = piece_tangent(piece, k, t)
        if constraint.closed[curve]:
            v += count if v < 0.0 else 0.0
            v -= count if v >= count else 0.0
        constraint.parameter[row] = v


@kernel
def slide_all(constraint, nodes, points, parameters, tangents):
    """Puts all of these nodes (K,) of points (N, 2) onto their curves, as ``snap`` does, each as if it moved alone.

    Writes their parameters (K,) there and unit tangents (K, 2); nothing is stored in the constraint.
    """
    for i in range(len(nodes)):
        node = nodes[i]
        points[node, 0], points[node, 1], parameters[i] = snap(constraint, node, points[node, 0], points[node, 1])
        k, t = piece_at(constraint, constraint.curve[constraint.row[node]], parameters[i])
        tangents[i, 0], tangents[i, 1] = piece_tangent(constraint.piece, k, t)


@kernel
def project(piece, points, closed, parameters, places):
    """The place nearest to each point (K, 2) on a curve of some pieces (P, 6): parameters (K,) and places (K, 2)."""
    for i in range(len(points)):
        best = np.inf
        for k in range(len(piece)):
            t = min(max(piece_parameter(piece, k, points[i, 0], points[i, 1]), 0.0), 1.0)
            x, y = piece_point(piece, k, t)
            away = (x - points[i, 0]) * (x - points[i, 0]) + (y - points[i, 1]) * (y - points[i, 1])
            if away < best:
                best, parameters[i], places[i, 0], places[i, 1] = away, k + t, x, y
        if closed and parameters[i] >= len(piece):
            parameters[i] = 0.0


@kernel
def tangents(piece, parameters, out):
    """The unit tangents (K, 2) of a curve of some pieces at parameters (K,)."""
    for i in range(len(parameters)):
        k = min(max(np.int64(np.floor(parameters[i])), 0), len(piece) - 1)
        out[i, 0], out[i, 1] = piece_tangent(piece, k, parameters[i] - k)

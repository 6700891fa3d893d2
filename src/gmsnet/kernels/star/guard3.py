"""Which moves are allowed in space: the rule of kernels.star.guard for tetrahedra.

With D = 6V and S = Σl², η = 12(3V)^(2/3)/Σl² is above φ just where D > c·S^(3/2), c = √(φ³/432). A floor is a c. In
float64 the computed S = 4(|a|² + |b|² + |c|²) − |a + b + c|² of spokes with components up to m is off by at most
32u·(4Σ|·|² + |s|²) + 160·mδ + 80δ², for each of the six squared edges changes by at most 24mδ + 12δ² with coordinates
known up to ±δ, and no term of the sum is larger than what is in brackets. From an upper bound S' of S follows that of
S^(3/2), S'·√S'·(1 + 8u).

A tetrahedron is *certified above* a floor c if D exceeds its own error bound and c times that bound. What is proven of
the levels in the plane holds in space word for word: their proofs use the rule and nothing of the plane.
"""

from __future__ import annotations

import math

import numpy as np

from gmsnet.kernels.jit.compile import LANES, inlined, kernel, part
from gmsnet.kernels.jit.vectors import WIDTH as LANES3
from gmsnet.kernels.simplex.jacobian3 import solid_workspace
from gmsnet.kernels.simplex.mean_ratio3 import HEXAHEDRON, same_cell3, square, weights_at
from gmsnet.kernels.simplex.orientation3 import determinant_and_bound, largest_component
from gmsnet.kernels.simplex.predicates import UNIT
from gmsnet.kernels.simplex.slack3 import ALONE, CELLS, FOR_ONE, SLACK, slacks_of
from gmsnet.kernels.simplex.validity3 import certified_solid

MIXED_BOUND = 2.0  # times ``error_bound3`` where cells are not all tetrahedra
LARGEST3 = 0.0481126  # above D/S^(3/2) of a regular tetrahedron, 1/√432
COARSE3 = 2.0**-24
WIDER = 1.0 + 2.0**-20


@inlined
def error_bound3(m, delta):
    """By how much the minimum D − c·S^(3/2) of a star, computed in float32 from what is kept of it, may be off.

    m: no component of the ring or of the step is larger, over the star's size; delta: by how much a coordinate may be
    off, over it, too. u = 2⁻²⁴. A spoke, from the free node, is off by e = 2u·m + 2δ, the step by u·m + δ. So are w by
    16m·e + 32u·m², D by 72m²·e + 160u·m³, t·w by 48m²·e + 184u·m³ + 24m²·δ, and D − t·w by 632u·m³ + 264m²·δ in all;
    S − 2t·s + 3|t|² by 895u·m² + 324m·δ; it is at most 72m², and c at most 1/√432, so that c·S^(3/2) is off by
    551m²(u·m + δ) and 88u·m³ for its own rounding. With the difference this is less than 1400m²(u·m + δ), and what is
    of second order in e is less than the rest, or the bound is more than any margin.

    The step of a node that is free is what its place is made of: its u·m is not needed. A node that slides lands in
    float64 (slide3.land3), and its step is rounded to float32 for it, by u·m at most; its place is not rounded again.

    Of other corner simplices the weights of S add up to 9 at most, without their signs. S − 2t·s + σ|t|² is then off by
    2500u·m² + 650m·δ, is at most 108m², and c·S^(3/2) is off by 1900u·m³ + 490m²·δ and 220u·m³: with D less than
    2800m²(u·m + δ). MIXED_BOUND times the bound is 4096m²(u·m + δ).
    """
    return 2048.0 * m * m * (COARSE3 * m + delta)


@inlined
def length_bounds(ax, ay, az, bx, by, bz, cx, cy, cz, delta):
    """S, and by how much it may be off."""
    sx, sy, sz = (ax + bx) + cx, (ay + by) + cy, (az + bz) + cz
    around = ((square(ax, ay, az) + square(bx, by, bz)) + square(cx, cy, cz)) * 4.0
    whole = square(sx, sy, sz)
    m = largest_component(ax, ay, az, bx, by, bz, cx, cy, cz)
    return around - whole, 32.0 * UNIT * (around + whole) + delta * (160.0 * m + 80.0 * delta)


@inlined
def length_bounds_by(ax, ay, az, bx, by, bz, cx, cy, cz, delta, weights=None):
    """The same by six weights, which add up to 9 at most without their signs; None: of a tetrahedron.

    A squared edge opposite to the spokes is less than twice the sum of those of its two spokes, of which it is made.
    """
    if weights is None:
        return length_bounds(ax, ay, az, bx, by, bz, cx, cy, cz, delta)
    wa, wb, wc, wab, wbc, wca = weights.a, weights.b, weights.c, weights.ab, weights.bc, weights.ca
    a, b, c = square(ax, ay, az), square(bx, by, bz), square(cx, cy, cz)
    ab, bc, ca = square(bx - ax, by - ay, bz - az), square(cx - bx, cy - by, cz - bz), square(ax - cx, ay - cy, az - cz)
    whole = ((a * wa + b * wb) + c * wc) + ((ab * wab + bc * wbc) + ca * wca)
    around = ((a * abs(wa) + b * abs(wb)) + c * abs(wc)) + 2.0 * (
        ((a + b) * abs(wab) + (b + c) * abs(wbc)) + (c + a) * abs(wca)
    )
    m = largest_component(ax, ay, az, bx, by, bz, cx, cy, cz)
    return whole, 32.0 * UNIT * around + delta * (240.0 * m + 120.0 * delta)


@inlined
def certified(ax, ay, az, bx, by, bz, cx, cy, cz, delta, floor, weights=None):
    """Is the tetrahedron with these spokes certified above a floor that is not negative?"""
    value, bound = determinant_and_bound(ax, ay, az, bx, by, bz, cx, cy, cz, delta)
    value -= bound
    if floor > 0.0:
        lengths, error = length_bounds_by(ax, ay, az, bx, by, bz, cx, cy, cz, delta, weights)
        most = lengths + error
        value -= floor * (most * math.sqrt(most)) * (1.0 + 8.0 * UNIT) * (1.0 + 4.0 * UNIT)
    return value > 0.0


@inlined
def ratio_upper_bound3(ax, ay, az, bx, by, bz, cx, cy, cz, delta, weights=None):
    """The most that D/S^(3/2) can be in exact arithmetic; 0 for what is certainly not positive, as floors need it."""
    value, bound = determinant_and_bound(ax, ay, az, bx, by, bz, cx, cy, cz, delta)
    lengths, error = length_bounds_by(ax, ay, az, bx, by, bz, cx, cy, cz, delta, weights)
    least = lengths - error
    ratio = min((value + bound) / (least * math.sqrt(max(least, 0.0))) * (1.0 + 16.0 * UNIT), LARGEST3)
    ratio = ratio if least > 0.0 else LARGEST3
    return 0.0 if value + bound <= 0.0 else ratio


@inlined
def ratio_of_row3(points, simplices, t, unit, grain):
    """The same of row t, read in its orientation."""
    rows, forth = simplices.rows, simplices.orientation[t] > 0
    v, a, b, c = rows[t, 0], rows[t, 1], rows[t, 2 if forth else 3], rows[t, 3 if forth else 2]
    x, y, z = points[v, 0], points[v, 1], points[v, 2]
    ax, ay, az = points[a, 0] - x, points[a, 1] - y, points[a, 2] - z
    bx, by, bz = points[b, 0] - x, points[b, 1] - y, points[b, 2] - z
    cx, cy, cz = points[c, 0] - x, points[c, 1] - y, points[c, 2] - z
    reach = max(max(abs(x), abs(y)), abs(z))
    m = largest_component(ax, ay, az, bx, by, bz, cx, cy, cz)
    weights = weights_at(simplices.shapes, t)
    return ratio_upper_bound3(ax, ay, az, bx, by, bz, cx, cy, cz, unit * (reach + m) + grain, weights)


@kernel
def ratio_upper_bounds3(points, simplices, blocks, unit, grain, first, last, least):
    """As guard.ratio_upper_bounds: the minimum over each of the blocks of LANES simplices, into ``least``."""
    work = np.ones(11 * LANES)
    for number in range(first, last):
        start = blocks[number] * LANES
        end, ratio = min(start + LANES, len(simplices.rows)), np.inf
        if simplices.shapes is None:
            gather3(points, simplices, start, end, work)
            for lane in range(end - start):
                work[10 * LANES + lane] = ratio_in_lane(work, lane, unit, grain)
            for lane in range(end - start):
                ratio = min(ratio, work[10 * LANES + lane])
        else:
            for t in range(start, end):
                ratio = min(ratio, ratio_of_row3(points, simplices, t, unit, grain))
        least[number] = ratio


@inlined
def gather3(points, simplices, first, last, work):
    """The spokes of rows first…last, read in their orientation, into rows 0 to 8 of a workspace; into row 9 how far
    their first nodes are from zero.
    """
    rows, orientation = simplices.rows, simplices.orientation
    for t in range(first, last):
        lane, forth = t - first, orientation[t] > 0
        v, x, y, z = place_of(points, rows[t, 0])
        for k, node in enumerate((rows[t, 1], rows[t, 2 if forth else 3], rows[t, 3 if forth else 2])):
            work[3 * k * LANES + lane] = points[np.uint32(node), 0] - x
            work[(3 * k + 1) * LANES + lane] = points[np.uint32(node), 1] - y
            work[(3 * k + 2) * LANES + lane] = points[np.uint32(node), 2] - z
        work[9 * LANES + lane] = v


@inlined
def place_of(points, node):
    """How far a node is from zero in any direction, and where it is."""
    i = np.uint32(node)
    x, y, z = points[i, 0], points[i, 1], points[i, 2]
    return max(max(abs(x), abs(y)), abs(z)), x, y, z


@inlined
def ratio_in_lane(work, lane, unit, grain):
    """``ratio_upper_bound3`` of what ``gather3`` has left."""
    ax, ay, az = work[lane], work[LANES + lane], work[2 * LANES + lane]
    bx, by, bz = work[3 * LANES + lane], work[4 * LANES + lane], work[5 * LANES + lane]
    cx, cy, cz = work[6 * LANES + lane], work[7 * LANES + lane], work[8 * LANES + lane]
    m = largest_component(ax, ay, az, bx, by, bz, cx, cy, cz)
    delta = unit * (work[9 * LANES + lane] + m) + grain
    return ratio_upper_bound3(ax, ay, az, bx, by, bz, cx, cy, cz, delta, None)


@kernel
def star_floors3(points, simplices, ringed, unit, grain, floors):
    """As guard.star_floors."""
    rows = simplices.rows
    for i in range(len(floors)):
        floors[i] = np.inf if ringed[i] else -np.inf
    t = 0
    while t < len(rows):
        ratio, end = ratio_of_row3(points, simplices, t, unit, grain), t + 1
        while same_cell3(simplices.cells, t, end):
            ratio = min(ratio, ratio_of_row3(points, simplices, end, unit, grain))
            end += 1
        for k in range(t, end):
            for corner in range(4):
                floors[rows[k, corner]] = min(floors[rows[k, corner]], ratio)
        t = end


@inlined
def floor_at(mixture, floors, centre, a, b, c, at, k, lane):
    """The floor of a simplex: the largest of the nodes of its cell."""
    floor = max(max(floors[a], floors[b]), max(floors[c], floors[centre]))
    if mixture is not None:
        nodes, owner = mixture.solids.nodes, mixture.owner[at // 3 + k * LANES3 + lane]
        for j in range(8):
            floor = max(floor, floors[nodes[owner, j]])
    return floor


@part
def sound(mixture, points, i, x, y, z, unit, grain):
    """Are the cells at node i certified to be valid everywhere with it at (x, y, z)? If so, it is to go there.

    Those of which corner simplices do not tell: hexahedra and wedges. Most have slack enough (kernels.simplex.slack3).
    """
    if mixture is not None:
        dx, dy, dz = x - points[i, 0], y - points[i, 1], z - points[i, 2]
        away, slack, gone, enough = WIDER * math.sqrt(square(dx, dy, dz)), mixture.slack, mixture.gone, True
        for k in range(mixture.at[i], mixture.at[i + 1]):
            enough &= slack[mixture.around[k] >> 3] >= gone[mixture.around[k]] + away
        if not enough:
            if not renewed(mixture, points, i, x, y, z, unit, grain, away):
                return False
            for k in range(mixture.at[i], mixture.at[i + 1]):
                slack[mixture.around[k] >> 3] = abs(slack[mixture.around[k] >> 3])
        for k in range(mixture.at[i], mixture.at[i + 1]):
            gone[mixture.around[k]] += away
    return True


@kernel
def moved_elsewhere(points, nodes, before, at, around, slack, gone):
    """Takes note that another guard has moved some nodes (k,), which were at before (k, 3): of cells that have no slack
    for that nothing is known any more. at, around, slack, gone: see kernels.star.space_blocks.Mixture."""
    for j in range(len(nodes)):
        i = nodes[j]
        dx, dy, dz = points[i, 0] - before[j, 0], points[i, 1] - before[j, 1], points[i, 2] - before[j, 2]
        away = WIDER * math.sqrt(square(dx, dy, dz))
        for k in range(at[i], at[i + 1]):
            gone[around[k]] += away
            if gone[around[k]] > slack[around[k] >> 3]:
                slack[around[k] >> 3] = 0.0


@part
def renewed(mixture, points, i, x, y, z, unit, grain, away):
    """Are those that have not slack enough certified? Theirs is made anew, with the other sign."""
    solids, slack, gone = mixture.solids, mixture.slack, mixture.gone
    work, numbers = np.empty(ALONE * CELLS + FOR_ONE), np.empty(CELLS, dtype=np.int32)
    k = mixture.at[i]
    while k < mixture.at[i + 1]:
        count = 0
        while k < mixture.at[i + 1] and count < CELLS:
            number = mixture.around[k] >> 3
            if not slack[number] >= gone[mixture.around[k]] + away:
                numbers[count] = number
                count += 1
            k += 1
        if count:
            slacks_of(points, solids, mixture.cells, numbers, count, unit, grain, i, x, y, z, work)
        for lane in range(count):
            cell, found = mixture.cells[numbers[lane]], work[SLACK * CELLS + lane]
            if found < 0.0:
                form = solids.hexahedron if solids.kind[cell] == HEXAHEDRON else solids.wedge
                nodes = solids.nodes[cell]
                if not certified_solid(points, nodes, form, 1.0, unit, grain, i, x, y, z, solid_workspace()):
                    for j in range(mixture.at[i], mixture.at[i + 1]):  # it does not go there
                        slack[mixture.around[j] >> 3] = max(slack[mixture.around[j] >> 3], 0.0)
                    return False
                found = 0.0
            slack[numbers[lane]] = -found
            for corner in range(8):
                gone[8 * numbers[lane] + corner] = 0.0
    return True

"""The Jacobian determinant of volume cells in Bernstein form, and how far its coefficients may be off.

A cell is described by a form, gmsnet.cells.jacobian.JacobianForm. Its nodes are taken relative to the first one. Write
δ for how far a coordinate may be off, u = 2⁻⁵³, s for the largest relative coordinate, and w for the form's spread, the
largest sum of absolute weights of nodes in a coefficient of U, V or W.

1. A coefficient of U, V or W is a sum of nodes whose weights add up to zero. So the first one does not matter, and
   it is off by wδ at most. With d roundings of each node (d the form's deviation) it is off by η = w(δ + 2d·u·s), twice
   the rounding to first order.
2. Let a, b and c be the largest |U|, |V| and |W| along the axes, as computed. A triple product is a sum of six products
   a_i b_j c_k, which these errors change by at most η·(σ(a,b) + σ(b,c) + σ(c,a)) + 2η²·(|a| + |b| + |c|) + 6η³, with
   σ(p,q) = Σ p_i q_j over i ≠ j and |·| the sum of the components.
3. A coefficient of det J is a mean of triple products with positive weights, and so is each one on a part of the cell.
   With N the form's roundings and those of the halvings it is off by at most N·u·P to first order, P = Σ a_i b_j c_k
   over the six permutations.

The bound is B = 9/8 of the data's part of step 2, and 2N·u·P. The surplus covers the rounding of the bound itself.
Signs that B certifies are those of every reading of the coordinates. A coordinate that is no number makes B none, which
certifies nothing.
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import inlined, part
from gmsnet.kernels.simplex.predicates import UNDERFLOW, UNIT

DEPTH = 18  # a cell is cut in half at most so many times
DATA = 1.125
# The workspace: one array, for compiled code pays for each that it is given. Sizes are the largest of all forms.
ROOM, VERTICES = 216, 6  # coefficients, vertices
NODES, ROWS, CROSSES, COEFFICIENTS, WHOLE = 0, 3 * 27, 3 * (27 + 54), 3 * (27 + 54 + 80), 3 * (27 + 54 + 80) + ROOM
STACK = WHOLE + ROOM
FRAMES = STACK + (DEPTH + 2) * ROOM
LEVELS = FRAMES + (DEPTH + 2) * 3 * VERTICES
PLACE = LEVELS + DEPTH + 2
SIZE = PLACE + 3


@part
def solid_workspace():
    """(SIZE,) for cells of all kinds."""
    return np.zeros(SIZE)


@inlined
def gather_solid(points, cell, form, moved, x, y, z, work):
    """The nodes of a cell, relative to its first one, into the workspace; returns its largest coordinate.

    points: (N, 3 or more). Where a node of the cell is ``moved``, x, y, z is where it is; −1: all are in place.
    """
    reach, fx, fy, fz = 0.0, 0.0, 0.0, 0.0
    for k in range(form.nodes):
        i = cell[k]
        px, py, pz = points[i, 0], points[i, 1], points[i, 2]
        if i == moved:
            px, py, pz = x, y, z
        if k == 0:
            fx, fy, fz = px, py, pz
        put(work, NODES + 3 * k, px - fx, py - fy, pz - fz)
        reach = max(reach, max(abs(px), max(abs(py), abs(pz))))
    return reach


@inlined
def put(work, place, x, y, z):
    """A vector into the workspace."""
    work[place], work[place + 1], work[place + 2] = x, y, z


@inlined
def largest_rows(form, first, last, work):
    """The largest component along each axis of the rows first…last, not scaled."""
    ax, ay, az = 0.0, 0.0, 0.0
    for r in range(first, last):
        share, k = form.floats[form.share + r], ROWS + 3 * r
        ax = max(ax, abs(work[k]) * share)
        ay = max(ay, abs(work[k + 1]) * share)
        az = max(az, abs(work[k + 2]) * share)
    return ax, ay, az


@inlined
def across(ax, ay, az, bx, by, bz):
    """σ of the module's text."""
    return ax * (by + bz) + ay * (bx + bz) + az * (bx + by)


@inlined
def expand_solid(form, orientation, delta, work):
    """Coefficients of orientation × det J of the gathered cell, into the workspace; returns their error bound B."""
    size, no_number = 0.0, 0.0  # becomes one where a coordinate is none: max() would pass over it
    for k in range(NODES, NODES + 3 * form.nodes):
        no_number += 0.0 * work[k]
        size = max(size, abs(work[k]))
    u, v, w, ints, floats = form.u, form.v, form.w, form.ints, form.floats
    for r in range(u + v + w):
        x, y, z = 0.0, 0.0, 0.0
        for e in range(ints[form.start + r], ints[form.start + r + 1]):
            k, weight = NODES + 3 * ints[form.node + e], floats[form.weight + e]
            x += weight * work[k]
            y += weight * work[k + 1]
            z += weight * work[k + 2]
        put(work, ROWS + 3 * r, x, y, z)
    for k in range(CROSSES, CROSSES + 3 * form.products):
        work[k] = 0.0
    for i in range(u):
        k = ROWS + 3 * i
        ax, ay, az = orientation * work[k], orientation * work[k + 1], orientation * work[k + 2]
        for j in range(v):
            k = ROWS + 3 * (u + j)
            bx, by, bz = work[k], work[k + 1], work[k + 2]
            p = CROSSES + 3 * ints[form.product + v * i + j]
            work[p] += ay * bz - az * by
            work[p + 1] += az * bx - ax * bz
            work[p + 2] += ax * by - ay * bx
    for k in range(COEFFICIENTS, COEFFICIENTS + form.terms):
        work[k] = 0.0
    for p in range(form.products):
        k = CROSSES + 3 * p
        ax, ay, az = work[k], work[k + 1], work[k + 2]
        for j in range(w):
            r = ROWS + 3 * (u + v + j)
            dot = ax * work[r] + ay * work[r + 1] + az * work[r + 2]
            work[COEFFICIENTS + ints[form.coefficient + w * p + j]] += dot
    for k in range(form.terms):
        work[COEFFICIENTS + k] /= floats[form.multinomial + k]
    ax, ay, az = largest_rows(form, 0, u, work)
    bx, by, bz = largest_rows(form, u, u + v, work)
    cx, cy, cz = largest_rows(form, u + v, u + v + w, work)
    return error_bound(form, ax, ay, az, bx, by, bz, cx, cy, cz, size, delta) + no_number


@inlined
def error_bound(form, ax, ay, az, bx, by, bz, cx, cy, cz, size, delta):
    """B of the module's text. size: s."""
    off = form.spread * (delta + 2.0 * form.deviation * UNIT * size)
    pairs = across(ax, ay, az, bx, by, bz) + across(bx, by, bz, cx, cy, cz) + across(cx, cy, cz, ax, ay, az)
    single = (ax + ay + az) + (bx + by + bz) + (cx + cy + cz)
    data = off * (pairs + off * (2.0 * single + 6.0 * off))
    product = ax * (by * cz + bz * cy) + ay * (bx * cz + bz * cx) + az * (bx * cy + by * cx)
    rounding = 2.0 * (form.roundings + DEPTH * form.halving) * UNIT
    return DATA * data + rounding * product + UNDERFLOW

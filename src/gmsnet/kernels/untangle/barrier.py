"""A barrier that inverted cells can cross (Garanzha, Kaporin, Kudryavtseva, Protais, Ray, Sokolov: Foldover-free maps
in 50 lines of code, ACM Transactions on Graphics 40(4), 2021), over the corner simplices of cells:

    E = Σ f/χ(D, ε s),   f = κ L/2,   χ(D, e) = (D + √(e² + D²))/2,   κ = 1/√3,

a, b two edges of a simplex, D = a × b, L = w_a |a|² + w_b |b|² + w_o |b − a|² (kernels.simplex.mean_ratio2), s the |D|
that simplices have thereabouts. χ is positive and smooth everywhere, and as ε → 0 it becomes D where D > 0 and 0
elsewhere, f/χ so the inverse mean ratio q, with infinity for an inverted simplex.

Of one node, w = ∇D and ∇f = −κ(w_a a + w_b b). The Hessian without the term of χ'' is that of a quadratic over a linear
function, f/(χ + χ'·w·(x − x₀)), and so positive semidefinite; its Newton step always goes downhill:

    ∇(f/χ) = (∇f − (f/χ) χ' w)/χ =: g,    ∇² ≈ (κ(w_a + w_b) I − χ'(w gᵀ + g wᵀ))/χ.
"""

from __future__ import annotations

import math

import numpy as np

from gmsnet.kernels.jit.compile import inlined, kernel, part
from gmsnet.kernels.simplex.mean_ratio2 import Weights, half_lengths, pull, roundness
from gmsnet.kernels.simplex.predicates import determinant_and_bound
from gmsnet.kernels.star.guard import margin_above
from gmsnet.kernels.star.pattern import pair_of, weights_of
from gmsnet.kernels.untangle.cells import margin
from gmsnet.kernels.untangle.untangling import star_of

KAPPA = 1.0 / math.sqrt(3.0)
THIRD = 1.0 / 3.0
HALVINGS = 12
ARMIJO = 1e-4
STEEP = 0.1  # while one step lowers the sum of a star by more than this share, the next follows on the spot
REPEATS = 5
TINY = 1e-300
FREELY, CERTIFIED, GUARDED, MENDING = range(4)  # what a sweep may do to cells


@inlined
def chi(d, e):
    """χ(D, e) and its derivative in D; for D < 0 without cancellation."""
    root = math.sqrt(e * e + d * d)
    value = 0.5 * (d + root) if d > 0.0 else 0.5 * e * (e / max(root - d, TINY))
    value = max(value, TINY)
    return value, value / max(root, TINY)


@inlined
def half_of(ax, ay, bx, by, weights):
    """L/2, which need not be exact where D is near 0."""
    if weights is None:
        return ax * ax + ay * ay + bx * bx + by * by - ax * bx - ay * by
    return half_lengths(ax, ay, bx, by, weights)


@inlined
def slope_of_a(a, b, weights):
    """A component of the gradient of L/2 by a; with a and b, and their weights, exchanged that by b."""
    if weights is None:
        return 2.0 * a - b
    return weights.a * a - weights.opposite * (b - a)


@inlined
def exchanged(weights):
    """With a and b exchanged."""
    if weights is None:
        return None
    return Weights(weights.b, weights.a, weights.opposite, weights.half)


@inlined
def row_weights(table, t):
    """The weights in row t of a table (c, 3); None where all are equilateral."""
    if table is None:
        return None
    return Weights(table[t, 0], table[t, 1], table[t, 2], 0.5)


@kernel
def energy(points, cells, table, scale, epsilon, gradient):
    """E of the simplices (c, 3), counter-clockwise, and its gradient by all nodes (m, 2).

    table: (c, 3) the weights of |a|², |b|² and |b − a|² seen from the first node of each, None where all are
    equilateral. scale: (m,) s of each node, of a simplex their mean.
    """
    gradient[:] = 0.0
    total = 0.0
    for t in range(len(cells)):
        i, j, k = cells[t, 0], cells[t, 1], cells[t, 2]
        ax, ay = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]
        bx, by = points[k, 0] - points[i, 0], points[k, 1] - points[i, 1]
        e = epsilon * THIRD * (scale[i] + scale[j] + scale[k])
        value, slope = chi(ax * by - ay * bx, e)
        weights = row_weights(table, t)
        swapped = exchanged(weights)
        q = KAPPA * half_of(ax, ay, bx, by, weights) / value
        total += q
        along, across = KAPPA / value, q * slope / value
        jx = along * slope_of_a(ax, bx, weights) - across * by
        jy = along * slope_of_a(ay, by, weights) + across * bx
        kx = along * slope_of_a(bx, ax, swapped) + across * ay
        ky = along * slope_of_a(by, ay, swapped) - across * ax
        gradient[j, 0] += jx
        gradient[j, 1] += jy
        gradient[k, 0] += kx
        gradient[k, 1] += ky
        gradient[i, 0] -= jx + kx
        gradient[i, 1] -= jy + ky
    return total


@part
def star(points, x, y, v, stars, scale, epsilon):
    """E of the star of v with the node at (x, y), gradient and Hessian (xx, xy, yy, as above)."""
    total, gx, gy, xx, xy, yy = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    first, n, simplices, pattern = star_of(stars, v)
    for k in range(simplices):
        i, j = pair_of(pattern, n, k)
        before, after, weights = stars.around[first + i], stars.around[first + j], weights_of(pattern, k, np.float64)
        ax, ay = points[before, 0] - x, points[before, 1] - y
        bx, by = points[after, 0] - x, points[after, 1] - y
        e = epsilon * THIRD * (scale[v] + scale[before] + scale[after])
        value, slope = chi(ax * by - ay * bx, e)
        inverse = 1.0 / value
        q = KAPPA * half_of(ax, ay, bx, by, weights) * inverse
        wx, wy = slope * (ay - by), slope * (bx - ax)
        hx = -(KAPPA * pull(ax, bx, weights) + q * wx) * inverse
        hy = -(KAPPA * pull(ay, by, weights) + q * wy) * inverse
        even = roundness(KAPPA, weights)
        total += q
        gx += hx
        gy += hy
        xx += 2.0 * (even - wx * hx) * inverse
        xy -= (wx * hy + wy * hx) * inverse
        yy += 2.0 * (even - wy * hy) * inverse
    return total, gx, gy, xx, xy, yy


@part
def is_certified(points, v, stars, unit, grain):
    """Is each simplex of the star of v certified?"""
    first, n, simplices, pattern = star_of(stars, v)
    for k in range(simplices):
        i, j = pair_of(pattern, n, k)
        if not margin(points, v, stars.around[first + i], stars.around[first + j], unit, grain) > 0.0:
            return False
    return True


@part
def keeps(points, v, x, y, stars, unit, grain, floor):
    """May v move to (x, y)? Certified simplices must stay so, the others become less inverted, certified above
    floor."""
    first, n, simplices, pattern = star_of(stars, v)
    for k in range(simplices):
        i, j = pair_of(pattern, n, k)
        before, after, weights = stars.around[first + i], stars.around[first + j], weights_of(pattern, k, np.float64)
        ax, ay = points[before, 0], points[before, 1]
        bx, by = points[after, 0], points[after, 1]
        reach = max(max(max(abs(ax), abs(ay)), max(abs(bx), abs(by))), max(abs(x), abs(y)))
        reach = max(reach, max(abs(points[v, 0]), abs(points[v, 1])))
        delta = unit * reach + grain
        value, bound = determinant_and_bound(ax, ay, bx, by, x, y, delta)
        if not value > bound:
            old, error_bound = determinant_and_bound(ax, ay, bx, by, points[v, 0], points[v, 1], delta)
            above = margin_above(ax - x, ay - y, bx - x, by - y, delta, floor, weights) > 0.0
            if not (old < -error_bound and value - bound > old + error_bound and above):
                return False
    return True


@kernel
def sweep(points, nodes, stars, scale, epsilon, mode, unit, grain, single, floor):
    """Newton steps for each of the nodes, one after another; returns how many have moved.

    points: (m, 2), changed, and rounded to float32 if single. epsilon: (m,). mode: FREELY, or CERTIFIED: only stars
    that are certified are looked at, and they stay so, or GUARDED: see ``keeps``, with its floor, or MENDING: besides,
    only stars that are not certified when their turn comes.
    A step is halved until the sum falls by ARMIJO of what the slope promises, and repeated while the sum falls steeply.
    """
    moved = 0
    for v in nodes:
        if mode in (CERTIFIED, MENDING) and is_certified(points, v, stars, unit, grain) != (mode == CERTIFIED):
            continue
        x0, y0 = points[v, 0], points[v, 1]
        total, gx, gy, xx, xy, yy = star(points, x0, y0, v, stars, scale, epsilon[v])
        for _ in range(REPEATS):
            x, y, old = points[v, 0], points[v, 1], total
            floor_of_hessian = 1e-9 * (xx + yy)
            xx += floor_of_hessian
            yy += floor_of_hessian
            determinant = xx * yy - xy * xy
            dx = (xy * gy - yy * gx) / determinant
            dy = (xy * gx - xx * gy) / determinant
            slope = gx * dx + gy * dy
            if not slope < 0.0:
                break
            taken = False
            for _ in range(HALVINGS):
                tx, ty = x + dx, y + dy
                if single:
                    tx, ty = np.float64(np.float32(tx)), np.float64(np.float32(ty))
                total, gx, gy, xx, xy, yy = star(points, tx, ty, v, stars, scale, epsilon[v])
                taken = total <= old + ARMIJO * slope
                if taken and mode >= GUARDED:
                    taken = keeps(points, v, tx, ty, stars, unit, grain, floor)
                if taken:
                    points[v, 0], points[v, 1] = tx, ty
                    if mode == CERTIFIED and not is_certified(points, v, stars, unit, grain):
                        points[v, 0], points[v, 1] = x, y
                        taken = False
                if taken:
                    break
                dx *= 0.5
                dy *= 0.5
                slope *= 0.5
            if not taken or not total < (1.0 - STEEP) * old:
                break
        moved += points[v, 0] != x0 or points[v, 1] != y0
    return moved


@kernel
def least(points, cells, scale, part, unit, grain, out):
    """The minimum of what exceeds the bound, over s, of the simplices of each part: out[part[first node]]."""
    out[:] = np.inf
    for t in range(len(cells)):
        a, b, c = cells[t, 0], cells[t, 1], cells[t, 2]
        s = THIRD * (scale[a] + scale[b] + scale[c])
        out[part[a]] = min(out[part[a]], margin(points, a, b, c, unit, grain) / s)


@kernel
def local_area(points, cells, rounds):
    """(m,) what |D| the simplices around each node have: the geometric mean, a few times averaged over neighbours."""
    nodes, count = len(points), len(cells)
    of_cell = np.empty(count)
    mean = 0.0
    for t in range(count):
        i, j, k = cells[t, 0], cells[t, 1], cells[t, 2]
        ax, ay = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]
        bx, by = points[k, 0] - points[i, 0], points[k, 1] - points[i, 1]
        of_cell[t] = abs(ax * by - ay * bx)
        mean += of_cell[t] / count
    if mean == 0.0:
        mean = 1.0
    for t in range(count):
        of_cell[t] = math.log(max(of_cell[t], 1e-12 * mean))
    total, number = np.empty(nodes), np.empty(nodes)
    for _ in range(rounds):
        total[:] = 0.0
        number[:] = 0.0
        for t in range(count):
            for c in range(3):
                total[cells[t, c]] += of_cell[t]
                number[cells[t, c]] += 1.0
        for i in range(nodes):
            total[i] /= number[i]
        for t in range(count):
            of_cell[t] = THIRD * (total[cells[t, 0]] + total[cells[t, 1]] + total[cells[t, 2]])
    return np.exp(total)

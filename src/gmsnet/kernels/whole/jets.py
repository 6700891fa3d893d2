"""Normals of a surface at its nodes: a cubic through the nodes of two rings, by least squares.

With the node as origin, z along a normal that is known roughly, and R² = x² + y² + z², the surface is taken for

    z = a·x + b·y + c·R² + d·(x² − y²) + e·2xy + R²(f·x + g·y) + h·(x³ − 3xy²) + i·(3x²y − y³)

which is its Taylor series up to the third order, with R² in the place of x² + y², so that c alone gives a sphere
exactly. Squared residuals count by 1/R⁴. The normal is (−a, −b, 1); where that is far from z the frame is turned to it
once (Cazals, Pouget: Estimating differential quantities using polynomial fitting of osculating jets, 2005).

Where the nodes do not tell a and b apart from the rest, as at the rim of a patch, the five terms up to R² are fitted to
the first ring; where they do not tell these apart either, the normal stays as it was.
"""

from __future__ import annotations

import math

import numpy as np

from gmsnet.kernels.jit.compile import kernel, part

MOST = 64  # nodes of two rings
CUBIC, QUADRATIC = 9, 5  # unknowns, a and b the last two of them
MORE = 3  # nodes than unknowns, before the cubic is asked
TINY = 1e-12  # of a pivot: nodes stand at distances near 1
TOLD = 0.02  # of what nodes tell of a and b, if there are no other unknowns, so much must be left beside these
UPSET = 1e-3  # squared tilt of the frame from which on it is turned and all is done again
UPRIGHT = 0.5  # the least cosine of a new normal with the one before


@kernel
def list_facets(own, start, facets):
    """Writes the facets (3F,) of each number in CSR form. own: (F, 3) numbers. start: (numbers + 2,) zeros."""
    for f in range(len(own)):
        for k in range(3):
            start[own[f, k] + 2] += 1
    for v in range(1, len(start)):
        start[v] += start[v - 1]
    for f in range(len(own)):
        for k in range(3):
            at = start[own[f, k] + 1]
            facets[at] = f
            start[own[f, k] + 1] = at + 1


@part
def gather(v, own, start, facets, mark, ring):
    """Lists the numbers of the first ring of v in ``ring``, and of the second one behind; returns how many of each."""
    count, mark[v] = 0, v
    for at in range(start[v], start[v + 1]):
        for k in range(3):
            u = own[facets[at], k]
            if mark[u] != v and count < MOST:
                mark[u], ring[count] = v, u
                count += 1
    first = count
    for j in range(first):
        for at in range(start[ring[j]], start[ring[j] + 1]):
            for k in range(3):
                u = own[facets[at], k]
                if mark[u] != v and count < MOST:
                    mark[u], ring[count] = v, u
                    count += 1
    return first, count


@part
def add_rows(place, v, ring, count, scale, frame, moments, row):
    """Writes the equations of some nodes into ``moments`` (9, 10), the last column their heights. row: (10,)."""
    for p in range(CUBIC):
        for q in range(CUBIC + 1):
            moments[p, q] = 0.0
    for j in range(count):
        dx = scale * (place[ring[j], 0] - place[v, 0])
        dy = scale * (place[ring[j], 1] - place[v, 1])
        dz = scale * (place[ring[j], 2] - place[v, 2])
        square = dx * dx + dy * dy + dz * dz
        if not square > 0.0:
            continue
        x = dx * frame[0, 0] + dy * frame[0, 1] + dz * frame[0, 2]
        y = dx * frame[1, 0] + dy * frame[1, 1] + dz * frame[1, 2]
        z = dx * frame[2, 0] + dy * frame[2, 1] + dz * frame[2, 2]
        share, xx, yy = 1.0 / square, x * x, y * y
        u, w = share * x, share * y
        row[0], row[1], row[2], row[3] = x, y, u * (xx - 3.0 * yy), w * (3.0 * xx - yy)
        row[4], row[5], row[6] = 1.0, share * (xx - yy), 2.0 * u * y
        row[7], row[8], row[9] = u, w, share * z
        for p in range(CUBIC):
            value = row[p]
            for q in range(CUBIC + 1):
                moments[p, q] += value * row[q]


@part
def least_left(a, b, c, d, e, f):
    """The least share, over all directions, that the form (d, e, f) of two variables has of the form (a, b, c)."""
    whole = a * c - b * b
    if not whole > 0.0:
        return 0.0
    half, product = 0.5 * (c * d - 2.0 * b * e + a * f) / whole, (d * f - e * e) / whole
    return half - math.sqrt(max(half * half - product, 0.0))


@part
def solve(moments, first):
    """Solves for the unknowns from ``first`` on, in place. Returns a, b, and whether the nodes tell them."""
    a, b, c = moments[7, 7], moments[7, 8], moments[8, 8]
    for p in range(first, 7):
        pivot = moments[p, p]
        if not pivot > TINY:
            return 0.0, 0.0, False
        share = 1.0 / pivot
        for q in range(p + 1, CUBIC):
            factor = share * moments[p, q]
            for r in range(CUBIC + 1):
                moments[q, r] -= factor * moments[p, r]
    d, e, f = moments[7, 7], moments[7, 8], moments[8, 8]
    if not least_left(a, b, c, d, e, f) > TOLD:
        return 0.0, 0.0, False
    slope = (d * moments[8, 9] - e * moments[7, 9]) / (d * f - e * e)
    return (moments[7, 9] - e * slope) / d, slope, True


@part
def turn(frame, x, y, z):
    """Writes axes with the third one along (x, y, z)."""
    length = math.sqrt(x * x + y * y + z * z)
    x, y, z = x / length, y / length, z / length
    frame[2, 0], frame[2, 1], frame[2, 2] = x, y, z
    if abs(x) < 0.7:
        ux, uy, uz = 0.0, z, -y
    else:
        ux, uy, uz = -z, 0.0, x
    length = math.sqrt(ux * ux + uy * uy + uz * uz)
    ux, uy, uz = ux / length, uy / length, uz / length
    frame[0, 0], frame[0, 1], frame[0, 2] = ux, uy, uz
    frame[1, 0], frame[1, 1], frame[1, 2] = y * uz - z * uy, z * ux - x * uz, x * uy - y * ux


@kernel
def fit_normals(place, own, start, facets, chosen, normal):
    """Makes the unit normals (numbers, 3) of chosen nodes anew.

    place: (numbers, 3) points. own: (F, 3) numbers. start, facets: see ``list_facets``. chosen: (numbers,) bool.
    """
    mark, ring = np.full(len(place), -1, dtype=np.int32), np.empty(MOST, dtype=np.int32)
    frame, moments, row = np.empty((3, 3)), np.empty((CUBIC, CUBIC + 1)), np.empty(CUBIC + 1)
    for v in range(len(place)):
        if not chosen[v]:
            continue
        first, count = gather(v, own, start, facets, mark, ring)
        total = 0.0
        for j in range(first):
            for axis in range(3):
                step = place[ring[j], axis] - place[v, axis]
                total += step * step
        if not total > 0.0:
            continue
        scale = math.sqrt(first / total)
        x, y, z, known = normal[v, 0], normal[v, 1], normal[v, 2], False
        for _ in range(2):
            turn(frame, x, y, z)
            a, b, told = 0.0, 0.0, False
            if count >= CUBIC + MORE:
                add_rows(place, v, ring, count, scale, frame, moments, row)
                a, b, told = solve(moments, 0)
            if not told and first >= QUADRATIC:
                add_rows(place, v, ring, first, scale, frame, moments, row)
                a, b, told = solve(moments, CUBIC - QUADRATIC)
            x = frame[2, 0] - a * frame[0, 0] - b * frame[1, 0]
            y = frame[2, 1] - a * frame[0, 1] - b * frame[1, 1]
            z = frame[2, 2] - a * frame[0, 2] - b * frame[1, 2]
            known |= told
            if a * a + b * b < UPSET:
                break
        turn(frame, x, y, z)
        cosine = frame[2, 0] * normal[v, 0] + frame[2, 1] * normal[v, 1] + frame[2, 2] * normal[v, 2]
        if known and cosine >= UPRIGHT:
            normal[v, 0], normal[v, 1], normal[v, 2] = frame[2, 0], frame[2, 1], frame[2, 2]

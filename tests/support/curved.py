"""Second-order planar cells in rational arithmetic: shape functions as polynomials, det J from their derivatives."""

from __future__ import annotations

import itertools
from fractions import Fraction
from functools import cache
from math import comb, factorial

import numpy as np

from support import exact
from support.exact import whole

PLACES = {  # reference coordinates of the nodes, doubled
    "triangle6": [(0, 0), (2, 0), (0, 2), (1, 0), (1, 1), (0, 1)],
    "quad8": [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)],
    "quad9": [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1), (1, 1)],
}
SCALE = 16
EXPONENTS = {
    "triangle6": [(m, n) for m in range(3) for n in range(3) if m + n <= 2],
    "quad8": [(m, n) for m in range(3) for n in range(3) if m + n <= 3],
    "quad9": [(m, n) for m in range(3) for n in range(3)],
}


def solve(matrix):
    """The inverse of a matrix of fractions, by Gauss and Jordan."""
    size = len(matrix)
    rows = [[*map(Fraction, row), *(Fraction(i == j) for j in range(size))] for i, row in enumerate(matrix)]
    for c in range(size):
        pivot = next(r for r in range(c, size) if rows[r][c])
        rows[c], rows[pivot] = rows[pivot], rows[c]
        rows[c] = [v / rows[c][c] for v in rows[c]]
        for r in range(size):
            if r != c:
                rows[r] = [v - rows[r][c] * w for v, w in zip(rows[r], rows[c], strict=True)]
    return [row[size:] for row in rows]


@cache
def shape_functions(kind):
    """Of each node: exponents → coefficient."""
    powers = EXPONENTS[kind]
    table = [[Fraction(x, 2) ** m * Fraction(y, 2) ** n for m, n in powers] for x, y in PLACES[kind]]
    inverse = solve(table)
    return [{e: inverse[k][i] for k, e in enumerate(powers)} for i in range(len(PLACES[kind]))]


def slope(polynomial, axis):
    made = {}
    for (m, n), value in polynomial.items():
        power = (m, n)[axis]
        if power:
            made[(m - 1, n) if axis == 0 else (m, n - 1)] = power * value
    return made


@cache
def pairs(kind):
    """For nodes i < j: the polynomial that p_i × p_j is multiplied by in SCALE·det J, in whole numbers."""
    functions = shape_functions(kind)
    slopes = [(slope(f, 0), slope(f, 1)) for f in functions]
    made = {}
    for i, j in itertools.combinations(range(len(functions)), 2):
        total = {}
        for (one, a), (two, b), sign in (
            ((slopes[i][0], 0), (slopes[j][1], 1), 1),
            ((slopes[i][1], 1), (slopes[j][0], 0), -1),
        ):
            assert (a, b) in ((0, 1), (1, 0))
            for (m, n), v in one.items():
                for (k, l), w in two.items():  # noqa: E741
                    total[m + k, n + l] = total.get((m + k, n + l), 0) + sign * v * w
        made[i, j] = {e: int(SCALE * v) for e, v in total.items() if v}
        assert all(v * SCALE == made[i, j][e] for e, v in total.items() if v)
    return made


def determinant(nodes, kind):
    """det J as exponents → Fraction. nodes: floats or fractions."""
    numbers, common = whole(v for node in nodes for v in node)
    x, y = numbers[::2], numbers[1::2]
    total = {}
    for (i, j), polynomial in pairs(kind).items():
        cross = x[i] * y[j] - y[i] * x[j]
        for e, v in polynomial.items():
            total[e] = total.get(e, 0) + cross * v
    return {e: Fraction(v, SCALE * common**2) for e, v in total.items()}


def value(polynomial, x, y):
    return exact.value(polynomial, (x, y))


@cache
def conversion(kind):
    """For each coefficient, in the order of gmsnet.kernels.simplex.bernstein: exponents → weight."""
    if kind == "triangle6":
        corners = [(0, 0), (2, 0), (0, 2), (1, 0), (1, 1), (0, 1)]
        powers = pairs_degree(kind)
        return [
            {(m, n): Fraction(falling(a, m) * falling(b, n) * factorial(2 - m - n), 2) for m, n in powers}
            for a, b in corners
        ]
    return [
        {(m, n): Fraction(comb(a, m) * comb(b, n), comb(3, m) * comb(3, n)) for m, n in pairs_degree(kind)}
        for a in range(4)
        for b in range(4)
    ]


def bernstein(polynomial, kind):
    """The coefficients of a polynomial in Bernstein form."""
    return [sum(v * row[e] for e, v in polynomial.items() if v and row.get(e)) for row in conversion(kind)]


@cache
def whole_conversion(kind):
    """``conversion`` times a number that makes all weights whole ones."""
    rows = conversion(kind)
    numbers = iter(whole(weight for row in rows for weight in row.values())[0])
    return [dict(zip(row, numbers, strict=False)) for row in rows]


def falling(a, m):
    return factorial(a) // factorial(a - m) if a >= m else 0


def substituted(polynomial, sx, tx, sy, ty):
    """The polynomial of (sx·x + tx, sy·y + ty)."""
    total = {}
    for (m, n), v in polynomial.items():
        for k in range(m + 1):
            for l in range(n + 1):  # noqa: E741
                more = v * comb(m, k) * sx**k * tx ** (m - k) * comb(n, l) * sy**l * ty ** (n - l)
                total[k, l] = total.get((k, l), 0) + more
    return total


def places_of_quarters(kind):
    """A sign and two shifts each: quarters have the points ((sign·x + one) / 2, (sign·y + other) / 2)."""
    last = (-1, 1, 1) if kind == "triangle6" else (1, 1, 1)
    return [(1, 0, 0), (1, 1, 0), (1, 0, 1), last]


def quarters(polynomial, kind):
    half = Fraction(1, 2)
    return [
        substituted(polynomial, sign * half, half * x, sign * half, half * y) for sign, x, y in places_of_quarters(kind)
    ]


def exact_sign(nodes, kind, depth=10, budget=2000):
    """+1: det J > 0 everywhere; −1: somewhere not; 0: not decided by so many halvings.

    All numbers are whole: a polynomial times a positive one has the same sign.
    """
    polynomial = determinant(nodes, kind)
    todo = [dict(zip(polynomial, whole(polynomial.values())[0], strict=True))]
    corners = [0, 1, 2] if kind == "triangle6" else [0, 3, 12, 15]
    for _ in range(depth + 1):
        parts = []
        for polynomial in todo:
            c = [sum(v * row.get(e, 0) for e, v in polynomial.items()) for row in whole_conversion(kind)]
            if min(c[k] for k in corners) <= 0:
                return -1
            if min(c) <= 0:
                doubled = {(m, n): v << (6 - m - n) for (m, n), v in polynomial.items()}
                parts += [substituted(doubled, sign, x, sign, y) for sign, x, y in places_of_quarters(kind)]
        if not parts:
            return 1
        if len(parts) > budget:
            return 0
        todo = parts
    return 0


def straight_nodes(corners):
    """Corners (3 or 4, 2) and the middles of the straight edges; of four corners also the centre."""
    middles = (corners + np.roll(corners, -1, axis=0)) / 2
    return np.vstack([corners, middles, corners.mean(axis=0)[None]][: 2 if len(corners) == 3 else 3])


def random_cell(rng, kind, bend):
    """A cell around the origin, counter-clockwise, with nodes off their straight places by about ``bend``."""
    count = 3 if kind == "triangle6" else 4
    angle = 2 * np.pi * (np.arange(count) + 0.3 * rng.uniform(-1, 1, count)) / count + rng.uniform(0, 7)
    corners = np.column_stack([np.cos(angle), np.sin(angle)]) * rng.uniform(0.5, 1.0, (count, 1))
    nodes = straight_nodes(corners)[: len(PLACES[kind])]
    nodes[count:] += bend * rng.normal(size=(len(nodes) - count, 2))
    return nodes


def pairs_degree(kind):
    """The exponents of det J."""
    return [(m, n) for m in range(4) for n in range(4) if kind != "triangle6" or m + n <= 2]

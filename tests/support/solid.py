"""Slow, obvious twins of what is computed of volume cells: polynomials over fractions, made from shape functions."""

from __future__ import annotations

from fractions import Fraction
from functools import cache
from itertools import product
from math import comb, factorial

import numpy as np

from support import exact
from support.exact import whole

F = Fraction
HALF = F(1, 2)


def multiply(p, q):
    """Polynomials are dicts: powers (a, b, c) of ξ, η, ζ → number."""
    out = {}
    for (a, b, c), s in p.items():
        for (d, e, f), t in q.items():
            key = (a + d, b + e, c + f)
            out[key] = out.get(key, 0) + s * t
    return out


def add(*terms):
    """The sum of polynomials."""
    out = {}
    for p in terms:
        for key, value in p.items():
            out[key] = out.get(key, 0) + value
    return out


def times(number, p):
    return {key: number * value for key, value in p.items()}


def derivative(p, axis):
    out = {}
    for key, value in p.items():
        if key[axis]:
            lower = tuple(k - (i == axis) for i, k in enumerate(key))
            out[lower] = out.get(lower, 0) + key[axis] * value
    return out


def value(p, place):
    return exact.value(p, place)


ONE = {(0, 0, 0): F(1)}
X, Y, Z = {(1, 0, 0): F(1)}, {(0, 1, 0): F(1)}, {(0, 0, 1): F(1)}
AXES = (X, Y, Z)

# Reference coordinates, from the tables of VTK's documentation: corners, then the middle of each edge in turn.
CUBE = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
PRISM = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1))
TET = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))
CUBE_EDGES = ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7))
PRISM_EDGES = ((0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5))
TET_EDGES = ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))
CUBE_FACES = ((0, HALF, HALF), (1, HALF, HALF), (HALF, 0, HALF), (HALF, 1, HALF), (HALF, HALF, 0), (HALF, HALF, 1))
PRISM_FACES = ((HALF, 0, HALF), (HALF, HALF, HALF), (0, HALF, HALF))


def middles(corners, edges):
    return tuple(tuple(F(corners[i][a] + corners[j][a], 2) for a in range(3)) for i, j in edges)


REFERENCE = {
    "tetra": TET,
    "tetra10": TET + middles(TET, TET_EDGES),
    "hexahedron": CUBE,
    "hexahedron20": CUBE + middles(CUBE, CUBE_EDGES),
    "hexahedron27": CUBE + middles(CUBE, CUBE_EDGES) + CUBE_FACES + ((HALF, HALF, HALF),),
    "wedge": PRISM,
    "wedge15": PRISM + middles(PRISM, PRISM_EDGES),
    "wedge18": PRISM + middles(PRISM, PRISM_EDGES) + PRISM_FACES,
    "pyramid": ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1)),
}


def monomials(name):
    """The powers whose polynomials a kind of cell maps with."""
    two = range(3)
    if name in ("tetra", "tetra10"):
        top = 1 if name == "tetra" else 2
        return [key for key in product(two, repeat=3) if sum(key) <= top]
    if name == "hexahedron":
        return list(product(range(2), repeat=3))
    if name == "hexahedron20":  # at most one power of two, besides those below
        return [key for key in product(two, repeat=3) if sum(k for k in key if k == 2) <= 2]
    if name == "hexahedron27":
        return list(product(two, repeat=3))
    if name == "wedge":
        return [(a, b, c) for a, b, c in product(range(2), repeat=3) if a + b <= 1]
    if name == "wedge18":
        return [(a, b, c) for a, b, c in product(two, repeat=3) if a + b <= 2]
    assert name == "wedge15"  # (all of degree two in the plane) × (1, ζ), and (1, ξ, η) × ζ²
    return [(a, b, c) for a, b, c in product(two, repeat=3) if a + b <= (2 if c < 2 else 1)]


def solve(matrix, right):
    """Gauss's rule over fractions; right: (n, m)."""
    n = len(matrix)
    rows = [list(map(F, a)) + list(map(F, b)) for a, b in zip(matrix, right, strict=True)]
    for k in range(n):
        pivot = next(i for i in range(k, n) if rows[i][k])
        rows[k], rows[pivot] = rows[pivot], rows[k]
        rows[k] = [v / rows[k][k] for v in rows[k]]
        for i in range(n):
            if i != k and rows[i][k]:
                rows[i] = [v - rows[i][k] * w for v, w in zip(rows[i], rows[k], strict=True)]
    return [row[n:] for row in rows]


def fraction(nodes):
    return [[F(float(v)) for v in node] for node in nodes]


@cache
def interpolation(name):
    """For each power, the weights of the nodes, as whole numbers, and what they are to be divided by."""
    keys = monomials(name)
    matrix = [[F(p[0]) ** a * F(p[1]) ** b * F(p[2]) ** c for a, b, c in keys] for p in REFERENCE[name]]
    inverse = solve(matrix, [[i == j for j in range(len(keys))] for i in range(len(keys))])
    numbers, common = whole(v for row in inverse for v in row)
    return [numbers[k : k + len(keys)] for k in range(0, len(numbers), len(keys))], common


def mapping(nodes, name):
    """x, y, z of a cell as polynomials in whole numbers, by interpolation of its nodes, and what to divide them by."""
    rows, below = interpolation(name)
    numbers, common = whole(np.ravel(nodes).tolist())
    axes = [numbers[axis::3] for axis in range(3)]
    maps = [[sum(w * v for w, v in zip(row, axis, strict=True) if w) for row in rows] for axis in axes]
    return [dict(zip(monomials(name), numbers, strict=True)) for numbers in maps], below * common


def determinant(nodes, name):
    """det J of a cell as a polynomial; of a pyramid what it is over the squared distance from its apex."""
    if name == "pyramid":
        points = fraction(nodes)
        shape = [multiply(u, v) for u, v in (
            (add(ONE, times(-1, X)), add(ONE, times(-1, Y))), (X, add(ONE, times(-1, Y))), (X, Y),
            (add(ONE, times(-1, X)), Y))]  # fmt: skip
        base = [add(*(times(points[k][axis], shape[k]) for k in range(4))) for axis in range(3)]
        columns = [[derivative(p, 0) for p in base], [derivative(p, 1) for p in base],
                   [add(times(points[4][axis], ONE), times(-1, base[axis])) for axis in range(3)]]  # fmt: skip
        divisor = 1
    else:
        maps, divisor = mapping(nodes, name)
        columns = [[derivative(p, axis) for p in maps] for axis in range(3)]
    (a, b, c), total = columns, {}
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        minor = add(multiply(b[j], c[k]), times(-1, multiply(b[k], c[j])))
        total = add(total, multiply(a[i], minor))
    return {key: F(v) / divisor**3 for key, v in total.items()}


@cache
def basis(name, index):
    """A Bernstein polynomial by its multi-index over the factors of the reference cell."""
    family = name.rstrip("0123456789")
    if family in ("hexahedron", "pyramid"):
        out = ONE
        for axis in range(3 if family == "hexahedron" else 2):
            low, high = index[2 * axis], index[2 * axis + 1]
            out = times(comb(low + high, high), out)
            for factor, count in ((add(ONE, times(-1, AXES[axis])), low), (AXES[axis], high)):
                for _ in range(count):
                    out = multiply(out, factor)
        return out
    first = add(ONE, *(times(-1, axis) for axis in (AXES if family == "tetra" else AXES[:2])))
    factors = (first, X, Y, Z) if family == "tetra" else (first, X, Y)
    powers = index[: len(factors)]
    out = times(F(factorial(sum(powers))), ONE)
    for factor, count in zip(factors, powers, strict=True):
        out = times(F(1, factorial(count)), out)
        for _ in range(count):
            out = multiply(out, factor)
    if family == "wedge":
        low, high = index[3:]
        out = times(comb(low + high, high), out)
        for factor, count in ((add(ONE, times(-1, Z)), low), (Z, high)):
            for _ in range(count):
                out = multiply(out, factor)
    return out


def indices(name):
    """The multi-indices of the coefficients of det J, in the order of gmsnet.cells.jacobian."""
    family, quadratic = name.rstrip("0123456789"), any(c.isdigit() for c in name)
    sizes, degrees = {
        "tetra": ((4,), (3 if quadratic else 0,)),
        "wedge": ((3, 2), (4, 5) if quadratic else (1, 2)),
        "hexahedron": ((2, 2, 2), (5,) * 3 if quadratic else (2,) * 3),
        "pyramid": ((2, 2), (2, 2)),
    }[family]
    parts = [
        [index for index in product(range(degree + 1), repeat=size) if sum(index) == degree]
        for size, degree in zip(sizes, degrees, strict=True)
    ]
    return sorted((tuple(i for part in parts_ for i in part) for parts_ in product(*parts)), reverse=True)


def from_bernstein(coefficients, name):
    """The polynomial of some coefficients, in the order of ``indices``."""
    return add(*(times(c, basis(name, index)) for c, index in zip(coefficients, indices(name), strict=True)))


def reference_nodes(name):
    return np.array([[float(v) for v in place] for place in REFERENCE[name]])


def random_cell(rng, name, bend):
    """The reference cell, mapped by a random affine map that keeps its orientation, its nodes off by ``bend``."""
    while True:
        turn = rng.normal(size=(3, 3))
        if np.linalg.det(turn) > 0.05:
            break
    nodes = reference_nodes(name)
    return (nodes + rng.uniform(-bend, bend, nodes.shape)) @ turn.T


def samples(name, count):
    """Places of a grid in the reference cell."""
    family, steps = name.rstrip("0123456789"), [F(k, count) for k in range(count + 1)]
    inside = {
        "hexahedron": lambda x, y, z: True, "pyramid": lambda x, y, z: z == 0,
        "wedge": lambda x, y, z: x + y <= 1, "tetra": lambda x, y, z: x + y + z <= 1,
    }[family]  # fmt: skip
    return [place for place in product(steps, repeat=3) if inside(*place)]

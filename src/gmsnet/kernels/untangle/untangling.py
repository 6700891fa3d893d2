"""The patches around cells that are to be untangled, and plain Laplacian sweeps that no guard holds back."""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import inlined, kernel, part
from gmsnet.kernels.star.pattern import count_of, neighbour_weight, neighbours, pair_of, pattern_at, weights_of
from gmsnet.kernels.untangle.cells import margin, share

TINY = 1e-290  # stands in for a squared length of zero


@kernel
def grow(chosen, start, ring, rings):
    """Adds to the chosen nodes (N, bool, in place) the free ones within so many rings of them; True if any is left out.

    start, ring: CSR by node, empty rings where held.
    """
    front = np.flatnonzero(chosen)
    after = np.empty(len(chosen), dtype=front.dtype)
    for _ in range(rings):
        count = 0
        for v in front:
            for k in range(start[v], start[v + 1]):
                other = ring[k]
                if not chosen[other] and start[other + 1] > start[other]:
                    chosen[other] = True
                    after[count] = other
                    count += 1
        if count == 0:
            return False
        front = after[:count].copy()
    return True


@inlined
def star_of(stars, v):
    """Of node v: where the nodes around it begin, how many they are, how many simplices it has, and the pattern."""
    first = stars.start[v]
    n, pattern = stars.start[v + 1] - first, pattern_at(stars.patterns, stars.pattern, v)
    return first, n, count_of(pattern, n), pattern


@inlined
def put_row(table, row, weights):
    """Weights into a row of a table (c, 3), if there is one."""
    if table is not None:
        table[row, 0], table[row, 1], table[row, 2] = weights.a, weights.b, weights.opposite


@kernel
def cut(nodes, stars, number, table):
    """The patch of some free nodes, in numbers of its own: the nodes in the order given, then those around them.

    number: (N,) of −1, and again so at the end. table: room for the weights of as many simplices as the nodes have,
    None where all are equilateral. Returns every (m,) node of the patch, and in the patch's numbers start and around
    (CSR) of the nodes and the simplices (c, 3), counter-clockwise, that have one of them. Each begins with the first
    of the nodes that it has, and row c of the table has its weights seen from there.
    """
    count, spokes, most = len(nodes), 0, 0
    for k in range(count):
        number[nodes[k]] = k
        _, n, simplices, _ = star_of(stars, nodes[k])
        spokes += n
        most += simplices
    every = np.empty(count + spokes, dtype=np.int32)
    for k in range(count):  # assigning a slice would take seconds to compile
        every[k] = nodes[k]
    start = np.zeros(count + 1, dtype=np.int32)
    around = np.empty(spokes, dtype=np.int32)
    cells = np.empty((most, 3), dtype=np.int32)
    end, size, made = 0, count, 0
    for k in range(count):
        first, n, simplices, pattern = star_of(stars, nodes[k])
        for at in range(first, first + n):
            other = stars.around[at]
            if number[other] < 0:
                number[other] = size
                every[size] = other
                size += 1
            around[end] = number[other]
            end += 1
        start[k + 1] = end
        for s in range(simplices):
            i, j = pair_of(pattern, n, s)
            a, b = around[start[k] + i], around[start[k] + j]
            if (a >= count or a > k) and (b >= count or b > k):  # its first node of the patch makes the simplex
                cells[made, 0], cells[made, 1], cells[made, 2] = k, a, b
                put_row(table, made, weights_of(pattern, s, np.float64))
                made += 1
    for k in range(size):
        number[every[k]] = -1
    return every[:size].copy(), start, around, cells[:made].copy()


@part
def bad_in_star(points, v, stars, unit, grain):
    """How many simplices of the star of v are not certified."""
    count = 0
    first, n, simplices, pattern = star_of(stars, v)
    for k in range(simplices):
        i, j = pair_of(pattern, n, k)
        count += not margin(points, v, stars.around[first + i], stars.around[first + j], unit, grain) > 0.0
    return count


@kernel
def bad_shares(points, nodes, stars, unit, grain):
    """Which share of the simplices of each node's star is not certified."""
    out = np.empty(len(nodes))
    for k in range(len(nodes)):
        _, _, simplices, _ = star_of(stars, nodes[k])
        out[k] = bad_in_star(points, nodes[k], stars, unit, grain) / simplices
    return out


@kernel
def average(points, nodes, stars, weighing, unit, grain, single):
    """Puts each of the nodes, one after another, into the mean of its neighbours, if its star is bad by then.

    Whatever becomes of its cells. weighing: so many steps from the mean towards the geometric median (E. Weiszfeld,
    Tôhoku Mathematical Journal 43, 1937), which a neighbour far away hardly pulls. single: rounded to float32.
    """
    for v in nodes:
        if not bad_in_star(points, v, stars, unit, grain):
            continue
        first, n, _, pattern = star_of(stars, v)
        x, y = 0.0, 0.0
        for k in range(n):
            other, weight = stars.around[first + k], neighbour_weight(pattern, k)
            x += weight * points[other, 0]
            y += weight * points[other, 1]
        x /= neighbours(pattern, n)
        y /= neighbours(pattern, n)
        for _ in range(weighing):
            x, y = weigh(points, v, stars, x, y)
        if single:
            x, y = np.float64(np.float32(x)), np.float64(np.float32(y))
        points[v, 0], points[v, 1] = x, y


@part
def weigh(points, v, stars, x, y):
    """The mean of the neighbours of v weighted by the inverse distances from (x, y), the nearest one's a little
    larger."""
    first, n, _, pattern = star_of(stars, v)
    nearest = np.inf
    for k in range(n):
        other = stars.around[first + k]
        dx, dy = points[other, 0] - x, points[other, 1] - y
        if neighbour_weight(pattern, k) > 0.0:
            nearest = min(nearest, dx * dx + dy * dy)
    total, sx, sy = 0.0, 0.0, 0.0
    for k in range(n):
        other = stars.around[first + k]
        dx, dy = points[other, 0] - x, points[other, 1] - y
        weight = neighbour_weight(pattern, k) / np.sqrt(dx * dx + dy * dy + 0.1 * nearest + TINY)
        total += weight
        sx += weight * dx
        sy += weight * dy
    return x + sx / total, y + sy / total


@kernel
def go_back(points, before, nodes, stars, limit, unit, grain):
    """Puts nodes (one after another) back to where they were at first where nothing is lost by it; how many are back.

    All simplices of the star must be certified before and after it; those that then have a node elsewhere than at
    first must have a D/L of at least limit or what they had.
    """
    back = 0
    for v in nodes:
        x, y = points[v, 0], points[v, 1]
        if (x == before[v, 0] and y == before[v, 1]) or bad_in_star(points, v, stars, unit, grain):
            continue
        first, n, simplices, pattern = star_of(stars, v)
        fits = True
        for k in range(simplices):
            i, j = pair_of(pattern, n, k)
            a, b, weights = stars.around[first + i], stars.around[first + j], weights_of(pattern, k, np.float64)
            least = min(limit, share(points, v, a, b, weights))
            points[v, 0], points[v, 1] = before[v, 0], before[v, 1]
            away = points[a, 0] != before[a, 0] or points[a, 1] != before[a, 1]
            away |= points[b, 0] != before[b, 0] or points[b, 1] != before[b, 1]
            fits = margin(points, v, a, b, unit, grain) > 0.0
            fits = fits and (not away or share(points, v, a, b, weights) >= least)
            points[v, 0], points[v, 1] = x, y
            if not fits:
                break
        if fits:
            points[v, 0], points[v, 1] = before[v, 0], before[v, 1]
            back += 1
    return back


@kernel
def uncertified(points, cells, unit, grain):
    """How many of the simplices (c, 3), counter-clockwise, are not certified."""
    count = 0
    for t in range(len(cells)):
        count += not margin(points, cells[t, 0], cells[t, 1], cells[t, 2], unit, grain) > 0.0
    return count

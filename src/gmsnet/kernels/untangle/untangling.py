"""Which cells are to be untangled, the patches around them, and plain Laplacian sweeps that no guard holds back.

A cell is *certified* if its determinant exceeds the error bound of kernels.simplex.predicates with all coordinates
known up to ±δ, δ = unit·(its largest coordinate) + grain: then it is positive as it is written, too.
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import kernel, part
from gmsnet.kernels.simplex.predicates import determinant_and_bound
from gmsnet.kernels.star.guard import margin_above, ratio_of

TINY = 1e-290  # stands in for a squared length of zero


@part
def margin(points, a, b, c, unit, grain):
    """By how much the determinant of the triangle a, b, c exceeds its bound; positive: certified."""
    ax, ay, bx, by = points[a, 0], points[a, 1], points[b, 0], points[b, 1]
    cx, cy = points[c, 0], points[c, 1]
    reach = max(max(max(abs(ax), abs(ay)), max(abs(bx), abs(by))), max(abs(cx), abs(cy)))
    value, bound = determinant_and_bound(ax, ay, bx, by, cx, cy, unit * reach + grain)
    return value - bound


@kernel
def find_bad(points, before, triangles, orientation, was_bad, unit, grain, bad):
    """Marks the cells that are to be untangled: not certified, and inverted at first or with a node that has moved.

    points, before: (N, 2), now and at first. triangles: (T, 3). orientation: (T,) ±1. was_bad, bad: (T,) bool. Returns
    how many.
    """
    count = 0
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        bad[t] = was_bad[t]
        if not was_bad[t]:
            for i in (a, b, c):
                if points[i, 0] != before[i, 0] or points[i, 1] != before[i, 1]:
                    bad[t] = True
        if bad[t]:
            if orientation[t] < 0:
                b, c = c, b
            bad[t] = not margin(points, a, b, c, unit, grain) > 0.0
            count += bad[t]
    return count


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


@kernel
def cut(nodes, start, ring, number):
    """The patch of some free nodes, in numbers of its own: the nodes in the order given, then those of their rings.

    number: (N,) of −1, and again so at the end. Returns every (m,) node of the patch, and in the patch's numbers start,
    ring (CSR) of the nodes and the cells (c, 3), counter-clockwise, that have one of them.
    """
    count, spokes = len(nodes), 0
    for k in range(count):
        number[nodes[k]] = k
        spokes += start[nodes[k] + 1] - start[nodes[k]]
    every = np.empty(count + spokes, dtype=np.int32)
    for k in range(count):  # assigning a slice would take seconds to compile
        every[k] = nodes[k]
    new_start = np.zeros(count + 1, dtype=np.int32)
    new_ring = np.empty(spokes, dtype=np.int32)
    cells = np.empty((spokes, 3), dtype=np.int32)
    end, size, made = 0, count, 0
    for k in range(count):
        v = nodes[k]
        for at in range(start[v], start[v + 1]):
            other = ring[at]
            if number[other] < 0:
                number[other] = size
                every[size] = other
                size += 1
            new_ring[end] = number[other]
            end += 1
        new_start[k + 1] = end
        for at in range(new_start[k], end):
            a, b = new_ring[at - 1 if at > new_start[k] else end - 1], new_ring[at]
            if (a >= count or a > k) and (b >= count or b > k):  # its first node of the patch makes the cell
                cells[made, 0], cells[made, 1], cells[made, 2] = k, a, b
                made += 1
    for k in range(size):
        number[every[k]] = -1
    return every[:size].copy(), new_start, new_ring, cells[:made].copy()


@part
def bad_in_star(points, v, start, ring, unit, grain):
    """How many cells of the star of v are not certified."""
    count = 0
    before = ring[start[v + 1] - 1]
    for at in range(start[v], start[v + 1]):
        after = ring[at]
        count += not margin(points, v, before, after, unit, grain) > 0.0
        before = after
    return count


@kernel
def bad_shares(points, nodes, start, ring, unit, grain):
    """Which share of the cells of each node's star is not certified."""
    out = np.empty(len(nodes))
    for k in range(len(nodes)):
        v = nodes[k]
        out[k] = bad_in_star(points, v, start, ring, unit, grain) / (start[v + 1] - start[v])
    return out


@kernel
def average(points, nodes, start, ring, weighing, unit, grain, single):
    """Puts each of the nodes, one after another, into the mean of its ring, if a cell of its star is bad by then.

    Whatever becomes of those cells. weighing: so many steps from the mean towards the geometric median (E. Weiszfeld,
    Tôhoku Mathematical Journal 43, 1937), which a neighbour far away hardly pulls. single: rounded to float32.
    """
    for v in nodes:
        if not bad_in_star(points, v, start, ring, unit, grain):
            continue
        x, y = 0.0, 0.0
        for k in range(start[v], start[v + 1]):
            x += points[ring[k], 0]
            y += points[ring[k], 1]
        degree = start[v + 1] - start[v]
        x /= degree
        y /= degree
        for _ in range(weighing):
            x, y = weigh(points, v, start, ring, x, y)
        if single:
            x, y = np.float64(np.float32(x)), np.float64(np.float32(y))
        points[v, 0], points[v, 1] = x, y


@part
def weigh(points, v, start, ring, x, y):
    """The mean of the ring of v weighted by the inverse distances from (x, y), the nearest one's a little larger."""
    nearest = np.inf
    for k in range(start[v], start[v + 1]):
        dx, dy = points[ring[k], 0] - x, points[ring[k], 1] - y
        nearest = min(nearest, dx * dx + dy * dy)
    total, sx, sy = 0.0, 0.0, 0.0
    for k in range(start[v], start[v + 1]):
        dx, dy = points[ring[k], 0] - x, points[ring[k], 1] - y
        weight = 1.0 / np.sqrt(dx * dx + dy * dy + 0.1 * nearest + TINY)
        total += weight
        sx += weight * dx
        sy += weight * dy
    return x + sx / total, y + sy / total


@kernel
def go_back(points, before, nodes, start, ring, limit, unit, grain):
    """Puts nodes (one after another) back to where they were at first where nothing is lost by it; how many are back.

    All cells of the star must be certified before and after it; those that then have a node elsewhere than at first
    must have a D/L of at least limit or what they had.
    """
    back = 0
    for v in nodes:
        x, y = points[v, 0], points[v, 1]
        if (x == before[v, 0] and y == before[v, 1]) or bad_in_star(points, v, start, ring, unit, grain):
            continue
        end = start[v + 1]
        fits = True
        for at in range(start[v], end):
            a, b = ring[at - 1 if at > start[v] else end - 1], ring[at]
            least = min(limit, share(points, v, a, b))
            points[v, 0], points[v, 1] = before[v, 0], before[v, 1]
            away = points[a, 0] != before[a, 0] or points[a, 1] != before[a, 1]
            away |= points[b, 0] != before[b, 0] or points[b, 1] != before[b, 1]
            fits = margin(points, v, a, b, unit, grain) > 0.0 and (not away or share(points, v, a, b) >= least)
            points[v, 0], points[v, 1] = x, y
            if not fits:
                break
        if fits:
            points[v, 0], points[v, 1] = before[v, 0], before[v, 1]
            back += 1
    return back


@kernel
def uncertified(points, cells, unit, grain):
    """How many of the cells (c, 3), counter-clockwise, are not certified."""
    count = 0
    for t in range(len(cells)):
        count += not margin(points, cells[t, 0], cells[t, 1], cells[t, 2], unit, grain) > 0.0
    return count


@kernel
def find_violated(points, before, triangles, orientation, was_bad, floor, unit, grain, violated):
    """Marks the cells with a node that has moved which stand against taking the points; returns how many.

    Those are the cells that were positive and are not certified, and those that were not positive, are not certified,
    and not certified above floor either, a D/L of at most 0 (L the sum of the squared sides).
    """
    count = 0
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        violated[t] = False
        for i in (a, b, c):
            if points[i, 0] != before[i, 0] or points[i, 1] != before[i, 1]:
                violated[t] = True
        if not violated[t]:
            continue
        if orientation[t] < 0:
            b, c = c, b
        violated[t] = not margin(points, a, b, c, unit, grain) > 0.0
        if violated[t] and was_bad[t]:
            violated[t] = not surplus_over(points, a, b, c, unit, grain, floor) > 0.0
        count += violated[t]
    return count


@kernel
def find_slivers(points, before, triangles, orientation, limit, slivers):
    """Marks the cells with a node that has moved whose D/L is below a limit."""
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        slivers[t] = False
        for i in (a, b, c):
            if points[i, 0] != before[i, 0] or points[i, 1] != before[i, 1]:
                slivers[t] = True
        if slivers[t]:
            if orientation[t] < 0:
                b, c = c, b
            slivers[t] = share(points, a, b, c) < limit


@part
def share(points, a, b, c):
    """D/L of the triangle a, b, c; 0 where all its nodes are in one place."""
    px, py = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
    qx, qy = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1]
    lengths = 2.0 * (px * px + py * py + qx * qx + qy * qy - px * qx - py * qy)
    return (px * qy - py * qx) / lengths if lengths > 0.0 else 0.0


@part
def surplus_over(points, a, b, c, unit, grain, floor):
    """By how much D of the triangle a, b, c exceeds floor·L and the bounds of both; positive: certified above it."""
    px, py = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
    qx, qy = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1]
    reach = max(abs(points[a, 0]), abs(points[a, 1])) + ((abs(px) + abs(py)) + (abs(qx) + abs(qy)))
    return margin_above(px, py, qx, qy, unit * reach + grain, floor, None)


@kernel
def least_ratio(points, triangles, orientation, unit, grain):
    """The minimum that a bound of D/L from above is over the cells (kernels.star.guard); 1/q is 2√3 times that."""
    least = np.inf
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        if orientation[t] < 0:
            b, c = c, b
        least = min(least, ratio_of(points, b, c, a, unit, grain, None))
    return least

"""Descent of single nodes on the Bernstein coefficients of the cells around them.

What a node drags along follows it by an affine map. So each coefficient, and for corners each determinant at a corner
of the straight cell, is a quadratic polynomial in the node's place: six values determine it. With these values v over
the mean size of the cell's coefficients, and t the place in units of the star's size, the objectives are

- to untangle, Σ max(0, τ − v)²: zero where all v ≥ τ; and
- to improve, −Σ log v, or the first one where a v is not positive at first.

To both κ|t − t₀|² is added for a middle or a centre, t₀ its straight place. For these two kinds of nodes v is affine
and both objectives are convex. Steps are of Gauss and Newton (∇v ∇vᵀ, without second derivatives of v). They are
halved until the objective falls.
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.curved.commit import commit_curved, curved_workspace, restore, save
from gmsnet.kernels.curved.stars import CENTRE, NO_EDGE, place, remember, serendipity
from gmsnet.kernels.jit.compile import kernel, part
from gmsnet.kernels.simplex.bernstein import COEFFICIENTS, CORNERS, NODES, QUAD9
from gmsnet.kernels.simplex.jacobian import expand, gather_cell, quality_of
from gmsnet.kernels.star.block import DROPPED, MOVED

UNTANGLE, IMPROVE = range(2)  # objectives
STEPS, SHORTENINGS = 20, 30
ARMIJO = 1e-4
LONGEST = 1.0  # step, in sizes of the star
END = 1e-6  # the shortest step
STRAIGHTENING = (1e-6, 0.5)  # κ by objective
SAMPLE = 0.25  # how far away samples are taken, in sizes of the star
DAMPING = 1e-10  # of the trace


@part
def star_size(points, mesh, i):
    """The largest distance, along an axis, between corners of a cell around a node."""
    size = 0.0
    for k in range(mesh.cell_start[i], mesh.cell_start[i + 1]):
        c = mesh.cell_of[k]
        first = mesh.cells[c, 0]
        for j in range(1, CORNERS[mesh.kinds[c]]):
            other = mesh.cells[c, j]
            size = max(size, abs(points[other, 0] - points[first, 0]))
            size = max(size, abs(points[other, 1] - points[first, 1]))
    return size


@part
def straight_place(points, mesh, i):
    """Where a middle or a centre lies in straight cells; whether the node is one."""
    e = mesh.edge_of_middle[i]
    if e != NO_EDGE:
        a, b = mesh.edges[e, 0], mesh.edges[e, 1]
        return 0.5 * (points[a, 0] + points[b, 0]), 0.5 * (points[a, 1] + points[b, 1]), True
    c = mesh.cell_of[mesh.cell_start[i]]
    if mesh.kinds[c] == QUAD9 and mesh.cells[c, CENTRE] == i:
        x, y = serendipity(points, mesh.cells, c)
        return x, y, True
    return points[i, 0], points[i, 1], False


@part
def sample(points, mesh, i, column, work):
    """Values of all rows of the model with the node where it is, into a column."""
    row, is_corner = 0, mesh.corner[i]
    for k in range(mesh.cell_start[i], mesh.cell_start[i + 1]):
        c, at = mesh.cell_of[k], k - mesh.cell_start[i]
        kind = mesh.kinds[c]
        gather_cell(points, mesh.cells[c], kind, work.cell)
        expand(kind, 0.0, work.cell)
        count = COEFFICIENTS[kind]
        if column == 0:
            total = 0.0
            for j in range(count):
                total += abs(work.cell.coefficients[j])
            work.scale[at] = count / total if total > 0.0 else 0.0
        for j in range(count):
            work.model[row, column] = work.scale[at] * work.cell.coefficients[j]
            row += 1
        nodes, corners = work.cell.nodes, CORNERS[kind]
        straight = 1 if corners == 3 else 4
        for j in range(straight if is_corner else 0):
            after, last = (j + 1) % corners, (j + corners - 1) % corners
            px, py = nodes[after, 0] - nodes[j, 0], nodes[after, 1] - nodes[j, 1]
            qx, qy = nodes[last, 0] - nodes[j, 0], nodes[last, 1] - nodes[j, 1]
            work.model[row, column] = work.scale[at] * (px * qy - py * qx)
            row += 1
    return row


@part
def fit(points, mesh, i, size, work):
    """The model around a node: rows of value, gradient and second derivatives in units of ``size``; returns how many.

    The node and what it drags are as before afterwards.
    """
    x, y = points[i, 0], points[i, 1]
    count = save(points, mesh, i, work)
    rows = 0
    for column in range(6):
        sx = SAMPLE * (1.0 if column == 1 or column == 5 else -1.0 if column == 2 else 0.0)
        sy = SAMPLE * (1.0 if column == 3 or column == 5 else -1.0 if column == 4 else 0.0)
        place(points, mesh, i, x + size * sx, y + size * sy, False)
        rows = sample(points, mesh, i, column, work)
    restore(points, count, work)
    for row in range(rows):
        m = work.model[row]
        value, gx, gy = m[0], 0.5 * (m[1] - m[2]), 0.5 * (m[3] - m[4])
        xx, yy = m[1] + m[2] - 2.0 * m[0], m[3] + m[4] - 2.0 * m[0]
        xy = m[5] - value - gx - gy - 0.5 * (xx + yy)
        m[0], m[1], m[2] = value, gx / SAMPLE, gy / SAMPLE
        m[3], m[4], m[5] = xx / SAMPLE**2, xy / SAMPLE**2, yy / SAMPLE**2
    return rows


@part
def objective(model, rows, mode, threshold, tx, ty, kappa, ox, oy):
    """Value, gradient and the Gauss–Newton matrix at t; infinite where ``IMPROVE`` is not defined."""
    rx, ry = tx - ox, ty - oy
    value, gx, gy = kappa * (rx * rx + ry * ry), 2.0 * kappa * rx, 2.0 * kappa * ry
    xx, xy, yy = 2.0 * kappa, 0.0, 2.0 * kappa
    for row in range(rows):
        m = model[row]
        vx, vy = m[1] + m[3] * tx + m[4] * ty, m[2] + m[4] * tx + m[5] * ty
        v = m[0] + 0.5 * ((m[1] + vx) * tx + (m[2] + vy) * ty)
        if mode == UNTANGLE:
            short = threshold - v
            if not short > 0.0:
                continue
            value += short * short
            slope, bend = -2.0 * short, 2.0
        else:
            if not v > 0.0:
                return np.inf, 0.0, 0.0, 0.0, 0.0, 0.0
            value -= np.log(v)
            slope, bend = -1.0 / v, 1.0 / (v * v)
        gx += slope * vx
        gy += slope * vy
        xx += bend * vx * vx
        xy += bend * vx * vy
        yy += bend * vy * vy
    return value, gx, gy, xx, xy, yy


@part
def descent(points, mesh, i, mode, threshold, work):
    """Where a node is to go, and whether the objective falls."""
    size = star_size(points, mesh, i)
    x, y = points[i, 0], points[i, 1]
    if not size > 0.0:
        return x, y, False
    sx, sy, inner = straight_place(points, mesh, i)
    rows = fit(points, mesh, i, size, work)
    kappa = STRAIGHTENING[mode] if inner else 0.0
    ox, oy = (sx - x) / size, (sy - y) / size
    tx, ty = 0.0, 0.0
    value, gx, gy, xx, xy, yy = objective(work.model, rows, mode, threshold, tx, ty, kappa, ox, oy)
    if mode == IMPROVE and not np.isfinite(value):  # valid cells may have coefficients that are not positive
        mode, kappa = UNTANGLE, STRAIGHTENING[UNTANGLE] if inner else 0.0
        value, gx, gy, xx, xy, yy = objective(work.model, rows, mode, threshold, tx, ty, kappa, ox, oy)
    if not np.isfinite(value):
        return x, y, False
    for _ in range(STEPS):
        damping = DAMPING * (xx + yy)
        determinant = (xx + damping) * (yy + damping) - xy * xy
        if not determinant > 0.0:
            break
        dx = -((yy + damping) * gx - xy * gy) / determinant
        dy = -((xx + damping) * gy - xy * gx) / determinant
        length = np.sqrt(dx * dx + dy * dy)
        if length > LONGEST:
            dx, dy, length = dx * LONGEST / length, dy * LONGEST / length, LONGEST
        slope, fell = gx * dx + gy * dy, False
        if not (slope < 0.0 and length > END):
            break
        for _ in range(SHORTENINGS):
            after = objective(work.model, rows, mode, threshold, tx + dx, ty + dy, kappa, ox, oy)
            if after[0] < value + ARMIJO * slope:
                fell = True
                break
            dx, dy, slope = 0.5 * dx, 0.5 * dy, 0.5 * slope
        if not fell:
            break
        tx, ty = tx + dx, ty + dy
        value, gx, gy, xx, xy, yy = after
    return x + size * tx, y + size * ty, tx != 0.0 or ty != 0.0


@part
def least_quality(points, mesh, i, guard, work):
    """The lowest ``quality_of`` the second-order cells around a node."""
    least = np.inf
    for k in range(mesh.cell_start[i], mesh.cell_start[i + 1]):
        c = mesh.cell_of[k]
        if NODES[mesh.kinds[c]] == CORNERS[mesh.kinds[c]]:
            continue
        delta = guard.unit * gather_cell(points, mesh.cells[c], mesh.kinds[c], work.cell) + guard.grain
        least = min(least, quality_of(mesh.kinds[c], expand(mesh.kinds[c], delta, work.cell), work.cell))
    return least


@kernel
def improve_nodes(points, mesh, nodes, threshold, guard, tally):
    """Newton steps on −Σ log v at free nodes (K,) around which the least quality of the cells is below the threshold.

    Moves go through ``commit_curved``. One that lowers the least quality of the cells around the node is taken back.
    """
    work = curved_workspace(mesh)
    for k in range(len(nodes)):
        i = nodes[k]
        before = least_quality(points, mesh, i, guard, work)
        if not 0.0 < before < threshold:
            continue
        x, y, fell = descent(points, mesh, i, IMPROVE, threshold, work)
        if not fell:
            continue
        count = commit_curved(points, mesh, i, x, y, guard, -np.inf, work, tally)
        if count > 0 and not least_quality(points, mesh, i, guard, work) >= before:
            restore(points, count, work)
            remember(points, mesh, i)
            tally[MOVED] -= 1
            tally[DROPPED] += 1


@kernel
def untangling_sweep(points, mesh, nodes, threshold, single):
    """Moves each of the nodes (K,) to where Σ max(0, τ − v)² is less, unguarded; returns how many have moved."""
    work = curved_workspace(mesh)
    moved = 0
    for k in range(len(nodes)):
        x, y, fell = descent(points, mesh, nodes[k], UNTANGLE, threshold, work)
        if fell:
            place(points, mesh, nodes[k], x, y, single)
            remember(points, mesh, nodes[k])
            moved += 1
    return moved


@kernel
def guarded_sweep(points, mesh, nodes, threshold, guard, tally):
    """The same where ``commit_curved`` allows it: what is valid stays so."""
    work = curved_workspace(mesh)
    for k in range(len(nodes)):
        x, y, fell = descent(points, mesh, nodes[k], UNTANGLE, threshold, work)
        if fell:
            commit_curved(points, mesh, nodes[k], x, y, guard, -np.inf, work, tally)


@kernel
def straighten(points, mesh, nodes, single):
    """Puts middles and centres (nodes, K) at their straight places and forgets their offsets."""
    for k in range(len(nodes)):
        x, y, inner = straight_place(points, mesh, nodes[k])
        if inner:
            place(points, mesh, nodes[k], x, y, single)
            remember(points, mesh, nodes[k])

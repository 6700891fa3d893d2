"""The Jacobian determinant of second-order planar cells in Bernstein form.

Source: A. Johnen, J.-F. Remacle, C. Geuzaine, "Geometrical validity of curvilinear finite elements", Journal of
Computational Physics 233, 2013.

The map of a cell from its reference cell (the unit triangle or the unit square) is quadratic. Its Bézier control
points B follow from the nodes: a corner is its own, the middle m of an edge between p and q gives 2m − (p + q)/2, and
the centre c of a quad gives 4c − Σm + Σp/4. Derivatives of the map are twice the differences of control points.

- A six-node triangle has U_α = B_{α+e1} − B_{α+e0} and V_α = B_{α+e2} − B_{α+e0}, |α| = 1. det J is quadratic, with
  the six coefficients c_{α+β} = 2 (U_α × V_β + U_β × V_α).
- A nine-node quad has U_ij = B_{i+1,j} − B_{ij} and V_kl = B_{k,l+1} − B_kl. det J is of degree 3 along both axes,
  with the sixteen coefficients c_ab = 4 Σ C(2,j) C(2,k)/(C(3,a) C(3,b)) U_ij × V_kl over i + k = a and j + l = b.
- An eight-node quad is a nine-node quad whose centre is c = (2 Σm − Σp)/4: the control point is Σm − ¾ Σp.

Coefficients at corners are values of det J; the others bound it. Where all nodes are at the middles of straight
edges, det J is twice the area of the triangle, and the determinant of the corner's edges at a corner of the quad.

Nodes are in the order of VTK and meshio: corners, then the middles of the edges 01, 12, …, then the centre. All
constants are whole numbers, so that ``py_func`` of each function here is exact on fractions.
"""

from __future__ import annotations

from gmsnet.kernels.jit.compile import part

TRIANGLE6, QUAD8, QUAD9, TRIANGLE, QUAD = range(5)  # the kinds of cells
NAMES = ("triangle6", "quad8", "quad9")
KINDS = (*NAMES, "triangle", "quad")  # the last two beside second-order cells, their middles those of straight edges
CORNERS = (3, 4, 4, 3, 4)
NODES = (6, 8, 9, 3, 4)
WIDEST = 9  # nodes of a cell at maximum, the width of a table of cells of several kinds
COEFFICIENTS = (6, 16, 16, 6, 16)
# Coefficients that are values of det J at corners; a triangle's first one stands twice.
CORNER_COEFFICIENTS = ((0, 1, 2, 0), (0, 12, 15, 3), (0, 12, 15, 3), (0, 1, 2, 0), (0, 12, 15, 3))
# Control points of quads lie on a grid, 3·i + j for i along 01 and j along 03.
GRID_CORNERS, GRID_MIDDLES, GRID_CENTRE = (0, 6, 8, 2), (3, 7, 5, 1), 4
# For each coefficient of a triangle, in the order 200, 020, 002, 110, 011, 101, its α and β.
FIRST, SECOND = (0, 1, 2, 0, 1, 0), (0, 1, 2, 1, 2, 2)
# Control points α + e_k of a triangle by α and k: a corner where α = e_k, else a middle.
LIFTED = ((0, 3, 5), (3, 1, 4), (5, 4, 2))
BINOMIAL2, BINOMIAL3 = (1, 2, 1), (1, 3, 3, 1)


@part
def straighten_edges(nodes, corners):
    """The middles of a first-order cell's edges, behind its corners (3 or 4). nodes: (8 or more, 2)."""
    for k in range(corners):
        after = (k + 1) % corners
        for axis in range(2):
            nodes[corners + k, axis] = (nodes[k, axis] + nodes[after, axis]) / 2


@part
def differences_of_triangle(nodes, control, first, second):
    """U and V (3, 2) of a six-node triangle from its nodes (6, 2), relative to any point. control: (9, 2), work."""
    for axis in range(2):
        for k in range(3):
            after = (k + 1) % 3
            control[k, axis] = nodes[k, axis]
            control[3 + k, axis] = 2 * nodes[3 + k, axis] - (nodes[k, axis] + nodes[after, axis]) / 2
        for k in range(3):
            first[k, axis] = control[LIFTED[k][1], axis] - control[LIFTED[k][0], axis]
            second[k, axis] = control[LIFTED[k][2], axis] - control[LIFTED[k][0], axis]


@part
def differences_of_quad(nodes, with_centre, control, first, second):
    """U (6, 2), row 3·i + j, and V (6, 2), row 2·k + l, of a quad from its nodes (8 or 9, 2), relative to any point."""
    for axis in range(2):
        corners = (nodes[0, axis] + nodes[1, axis]) + (nodes[2, axis] + nodes[3, axis])
        middles = (nodes[4, axis] + nodes[5, axis]) + (nodes[6, axis] + nodes[7, axis])
        for k in range(4):
            after = (k + 1) % 4
            control[GRID_CORNERS[k], axis] = nodes[k, axis]
            control[GRID_MIDDLES[k], axis] = 2 * nodes[4 + k, axis] - (nodes[k, axis] + nodes[after, axis]) / 2
        if with_centre:
            control[GRID_CENTRE, axis] = (4 * nodes[8, axis] - middles) + corners / 4
        else:
            control[GRID_CENTRE, axis] = middles - 3 * corners / 4
        for i in range(2):
            for j in range(3):
                first[3 * i + j, axis] = control[3 * i + 3 + j, axis] - control[3 * i + j, axis]
                second[2 * j + i, axis] = control[3 * j + i + 1, axis] - control[3 * j + i, axis]


@part
def coefficients_of_triangle(first, second, out):
    """The six coefficients of det J from U and V."""
    for k in range(6):
        a, b = FIRST[k], SECOND[k]
        forth = first[a, 0] * second[b, 1] - first[a, 1] * second[b, 0]
        back = first[b, 0] * second[a, 1] - first[b, 1] * second[a, 0]
        out[k] = 2 * (forth + back)


@part
def coefficients_of_quad(first, second, out):
    """The sixteen coefficients of det J from U and V, c_ab at 4·a + b."""
    for k in range(16):
        out[k] = 0
    for i in range(2):
        for j in range(3):
            for k in range(3):
                for l in range(2):  # noqa: E741 (the index of the formula above)
                    u, v = 3 * i + j, 2 * k + l
                    cross = first[u, 0] * second[v, 1] - first[u, 1] * second[v, 0]
                    out[4 * (i + k) + j + l] += BINOMIAL2[j] * BINOMIAL2[k] * cross
    for a in range(4):
        for b in range(4):
            out[4 * a + b] = 4 * out[4 * a + b] / (BINOMIAL3[a] * BINOMIAL3[b])


@part
def split_triangle(whole, children, row):
    """The coefficients on the four quarters of a triangle, into the rows from ``row`` on. whole: (6 or more,)."""
    for k in range(3):  # the quarter at corner k: the corner, the middles of its edges
        after, last = (k + 1) % 3, (k + 2) % 3
        own, edge, other, opposite = whole[k], whole[3 + k], whole[3 + last], whole[3 + after]
        near = (own + edge) / 2
        far = (own + other) / 2
        middle = (near + (edge + whole[after]) / 2) / 2
        middle_far = (far + (other + whole[last]) / 2) / 2
        inner = (near + (other + opposite) / 2) / 2
        # The quarter's corners: k, the middle of the edge k–after, the middle of the edge last–k.
        children[row + k, 0], children[row + k, 1], children[row + k, 2] = own, middle, middle_far
        children[row + k, 3], children[row + k, 4], children[row + k, 5] = near, inner, far
        children[row + 3, k] = middle  # the last quarter's corners: the middles of 01, 12, 20
        children[row + 3, 3 + last] = inner  # between the middles at both sides of corner k


@part
def split_quad(whole, children, row, work):
    """The coefficients on the four quarters of a square, into the rows from ``row`` on. work: (2, 16)."""
    for b in range(4):
        halve(whole, b, 4, work, 0, work, 1, b)
    for part_ in range(2):
        for a in range(4):
            halve(work[part_], 4 * a, 1, children, row + 2 * part_, children, row + 2 * part_ + 1, 4 * a)


@part
def halve(row, start, step, low, low_row, high, high_row, place):
    """De Casteljau's step at ½ on the four coefficients row[start], row[start + step], …"""
    p, q, r, s = row[start], row[start + step], row[start + 2 * step], row[start + 3 * step]
    pq, qr, rs = (p + q) / 2, (q + r) / 2, (r + s) / 2
    pqr, qrs = (pq + qr) / 2, (qr + rs) / 2
    middle = (pqr + qrs) / 2
    low[low_row, place], low[low_row, place + step] = p, pq
    low[low_row, place + 2 * step], low[low_row, place + 3 * step] = pqr, middle
    high[high_row, place], high[high_row, place + step] = middle, qrs
    high[high_row, place + 2 * step], high[high_row, place + 3 * step] = rs, s

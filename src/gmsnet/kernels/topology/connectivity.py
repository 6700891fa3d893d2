"""The closed fan of faces around each node, what keeps a node from having one, and colours.

Faces are polygons in CSR form: face f has the corners corner[first[f] : first[f + 1]]; ``first`` is None where all are
triangles. A corner is a face seen from one of its nodes: the face goes on to the node *after*, and comes from the node
*before*. The marks of a node are the bits below; a node without any is free.

Where time counts, what indexes an array is made unsigned: for signed numbers it is asked each time whether they count
from the end.
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import kernel, part
from gmsnet.kernels.topology.layout import corners_before, span

# Why a node is held, in the order in which reasons count.
(
    UNUSED,
    BOUNDARY,
    INTERFACE,
    LINE,
    FACE,
    UNSUPPORTED_CELL,
    NON_MANIFOLD,
    NON_ORIENTABLE,
    ZERO_AREA,
    CHOSEN,
    NOT_A_DISK,
    HIGH_VALENCE,
    SECOND_ORDER,
    MISMATCHED,
) = (1 << k for k in range(14))

WIDTH = 8  # neighbours: also of nodes with fewer, loops make so many rounds, so that processors foresee their end
AHEAD = 256  # nodes whose corners are listed at a time
HALF, LAST = 0xFFFFFFFF, 2**63 - 1
COLOURS = 30  # that fit into one int32 as bits
EXPONENT = np.full(37, -1)  # by the remainder by 37, which no two of the powers of two below 2³² share
EXPONENT[[2**c % 37 for c in range(COLOURS + 1)]] = range(COLOURS + 1)


@kernel
def touching(cells, chosen):
    """Rows (int32, ascending) of the triangles (T, 3) or tetrahedra (T, 4) that have a chosen node. chosen: (N,)."""
    rows = np.empty(len(cells), dtype=np.int32)
    count = 0
    for t in range(len(cells)):
        a, b, c, last = cells[t, 0], cells[t, 1], cells[t, 2], cells[t, -1]
        rows[count] = t
        count += chosen[a] | chosen[b] | chosen[c] | chosen[last]
    return rows[:count].copy()


@kernel
def walk_fans(first, corner, orientation, region, begin, identity, hub, marks, link, lists, start, ring):
    """The ring of each node that has a closed fan and no mark; the marks that follow from the faces around a node.

    orientation: (F,) int8; faces of orientation −1 are read backwards. region: (F,) int64, or none (0,) where all are
    the same. begin: (N + 1,), the faces whose lowest node is v are begin[v] … begin[v + 1] − 1. identity: (N,) the id
    of each node. marks: (N,) uint16; those are added that are known here: UNUSED, BOUNDARY, INTERFACE, NON_MANIFOLD,
    TORN, and HUB where there are more than ``hub`` neighbours (whose ring is kept). Writes the rings in CSR form:
    start (N + 1,), and ring, with room for as many as corners and WIDTH more: the nodes around, in the sense in which
    the faces are read, from the smallest id on. Returns whether all edges of two faces are read in both directions, as
    they must be.

    link (N + 1,), of the node at hand ≪ 32 | the node that follows this one around it, and lists (N,), the first corner
    listed at a node ≪ 32 | how many: int64 zeros, to work with.

    Corners are listed at their nodes some nodes ahead, and forgotten once the node has been visited. As near nodes are
    near in memory, few are listed at a time, and stay in the cache.
    """
    nodes = len(identity)
    # Of each corner listed: the node after ≪ 32 | the node before; its face (where regions differ); the next one of its
    # list. Number 0 is none. The first ``left`` of ``unused`` are not in use.
    pair, face = np.empty(1, dtype=np.int64), np.empty(1, dtype=np.int32)
    later, unused, left = np.empty(1, dtype=np.int32), np.empty(1, dtype=np.int32), 0
    pair[0] = face[0] = later[0] = unused[0] = 0
    others = np.empty(AHEAD, dtype=np.int64)  # nodes without a closed fan
    end, agrees = np.int64(0), True
    for ahead in range(0, nodes, AHEAD):
        until = min(ahead + AHEAD, nodes)
        here, there = np.int64(begin[ahead]), np.int64(begin[until])
        new = corners_before(first, there) - corners_before(first, here)
        if left < new:
            size, more = len(pair), max(len(pair), new)
            more += size
            pair, face = copied(pair, np.empty(more, dtype=np.int64)), copied(face, np.empty(more, dtype=np.int32))
            later = copied(later, np.empty(more, dtype=np.int32))
            unused = copied(unused, np.empty(more, dtype=np.int32))
            for number in range(size, more):
                unused[left] = number
                left += 1
        for f in range(here, there):
            low, count = span(first, f)
            for k in range(count):
                after = np.int64(corner[np.uint64(low + (k + 1 if k + 1 < count else 0))])
                before = np.int64(corner[np.uint64(low + (k - 1 if k > 0 else count - 1))])
                if orientation[f] < 0:
                    after, before = before, after
                left -= 1
                node, at = np.uint64(corner[np.uint64(low + k)]), np.int64(unused[np.uint64(left)])
                pair[np.uint64(at)] = after << 32 | before
                if len(region):
                    face[np.uint64(at)] = f
                listed = lists[node]
                later[np.uint64(at)] = listed >> 32
                lists[node] = at << 32 | (listed & HALF) + 1
        found = 0
        for v in range(ahead, until):
            start[v] = end
            at, count = lists[v] >> 32, lists[v] & HALF
            if count == 0:
                if not marks[v] & (LINE | UNSUPPORTED_CELL | SECOND_ORDER):
                    marks[v] |= UNUSED
                continue
            least = LAST
            for k in range(max(count, WIDTH)):
                counts = k < count
                both = pair[np.uint64(at)]
                after = both >> 32
                link[np.uint64(after if counts else nodes)] = np.int64(v) << 32 | both & HALF
                own = np.int64(identity[np.uint64(after)]) << 32 | after
                least = min(least, own if counts else LAST)
                unused[np.uint64(left)] = at
                left += counts
                at = np.int64(later[np.uint64(at)])
            foremost = least & HALF
            around, sound = foremost, 0
            for k in range(max(count, WIDTH)):
                ring[np.uint64(end + k)] = around
                following = link[np.uint64(around)]
                around = following & HALF
                # A closed fan: all links are of this node, and they come back at the last step, no sooner.
                sound += (k < count) & (following >> 32 == v) & ((around == foremost) == (k == count - 1))
            if sound != count or count < 3:
                others[found] = v
                found += 1
                continue
            if len(region):
                at = lists[v] >> 32
                own = region[face[at]]
                for _ in range(count):
                    if region[face[at]] != own:
                        marks[v] |= INTERFACE
                    at = np.int64(later[at])
            if not marks[v]:
                end += count
                if count > hub:
                    marks[v] |= HIGH_VALENCE
        for k in range(found):  # what they have listed is still there
            v = others[k]
            mark, both_ways = look_at_edges(v, lists[v], pair, face, later, region, link)
            marks[v] |= mark
            agrees &= both_ways
            if not marks[v]:
                marks[v] |= NOT_A_DISK
    start[nodes] = end
    return agrees


@part
def copied(values, longer):
    """The longer array, with the values at its beginning and zeros behind."""
    for k in range(len(values)):
        longer[k] = values[k]
    for k in range(len(values), len(longer)):
        longer[k] = 0
    return longer


@part
def look_at_edges(v, listed, pair, face, later, region, link):
    """BOUNDARY, NON_MANIFOLD, INTERFACE for node v as its edges are, and whether edges of two faces are read both ways.

    Linear in its corners: see ``walk_fans``. link: here of the node at hand ≪ 32 | the number of the edge.
    """
    head, count = listed >> 32, listed & HALF
    faces, balance = np.empty(2 * count, dtype=np.int64), np.empty(2 * count, dtype=np.int64)
    own, differ = np.empty(2 * count, dtype=np.int64), np.empty(2 * count, dtype=np.int64)
    at = head
    for _ in range(count):
        link[pair[at] >> 32] = link[pair[at] & HALF] = -1 << 32
        at = np.int64(later[at])
    edges, at = 0, head
    for _ in range(count):
        here = region[face[at]] if len(region) else 0
        for way in (1, -1):
            other = pair[at] >> 32 if way > 0 else pair[at] & HALF
            if other == v and way < 0:  # a face that names a node twice running: the edge has been seen as it left
                continue
            if link[other] >> 32 != v:
                link[other] = np.int64(v) << 32 | edges
                own[edges] = here
                faces[edges] = balance[edges] = differ[edges] = 0
                edges += 1
            e = link[other] & HALF
            differ[e] |= own[e] != here
            faces[e] += 1
            balance[e] += way
        at = np.int64(later[at])
    found, both_ways = 0, True
    for e in range(edges):
        if faces[e] == 1:
            found |= BOUNDARY
        elif faces[e] > 2:
            found |= NON_MANIFOLD
        else:
            both_ways &= balance[e] == 0
            if differ[e] != 0:
                found |= INTERFACE
    return found, both_ways


@kernel
def colour(places, start, ring, colours):
    """Greedy first-fit colours in the order of ``places`` (of the free nodes): no two of one ring share a colour.

    start, ring: CSR by places, ring with WIDTH more. colours: (N,) int32 zeros. Where COLOURS suffice, they become the
    colours, −1 where no free node is, and True is returned.
    """
    suffice = True
    for i in range(len(places)):  # in these rounds 1 ≪ colour; 0: none yet
        v = places[i]
        low, count = np.int64(start[v]), np.int64(start[v + 1]) - np.int64(start[v])
        taken = np.int32(0)
        for k in range(max(count, WIDTH)):
            other = colours[np.uint64(ring[np.uint64(low + k)])]
            taken |= other if k < count else np.int32(0)
        suffice &= taken < (1 << COLOURS) - 1
        colours[v] = ~taken & (taken + 1)
    for v in range(len(colours)):
        colours[v] = EXPONENT[colours[v] % 37]
    return suffice


@kernel
def colour_many(places, start, ring, colours):
    """The same for any number of colours. colours: (N,) int32, −1 before."""
    most = 0
    for v in places:
        most = max(most, start[v + 1] - start[v])
    taken = np.full(most + 1, -1, dtype=np.int64)
    for v in places:
        for k in range(start[v], start[v + 1]):
            if colours[ring[k]] >= 0:
                taken[colours[ring[k]]] = v
        c = 0
        while taken[c] == v:
            c += 1
        colours[v] = c

"""Compiled welding: corners with equal coordinates become one node. And words that repeat, or are spelt differently."""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import kernel, part

EMPTY = -1  # in the table of nodes
LEAST_NORMAL = 2.0**-1022


@part
def _mixed(bits, number):
    """A hash of 64 bits and a number (the finaliser of MurmurHash3)."""
    bits ^= number
    bits = (bits ^ (bits >> np.uint64(33))) * np.uint64(0xFF51AFD7ED558CCD)
    bits = (bits ^ (bits >> np.uint64(33))) * np.uint64(0xC4CEB9FE1A85EC53)
    return bits ^ (bits >> np.uint64(33))


@kernel
def weld(corners, at, found, points, table, node):
    """Numbers corners[at:] (n, 3) by their coordinates, in the order in which these appear first.

    points: of the ``found`` nodes so far, with room for more. table: EMPTY or a node, in the place that a hash gives or
    behind; its length is a power of two. Fills node and points until the points take up half of the table. Returns the
    next corner and the number of nodes.
    """
    last = np.uint64(len(table) - 1)
    for k in range(at, len(corners)):
        x, y, z = corners[k, 0] + 0.0, corners[k, 1] + 0.0, corners[k, 2] + 0.0  # without zeros below zero
        place = _mixed(np.float64(x).view(np.uint64), np.uint64(0))
        place = _mixed(np.float64(y).view(np.uint64), place)
        place = _mixed(np.float64(z).view(np.uint64), place) & last
        while True:
            j = table[place]
            if j == EMPTY:
                if 2 * found >= len(table) or found >= len(points):
                    return k, found
                table[place] = found
                points[found, 0], points[found, 1], points[found, 2] = corners[k, 0], corners[k, 1], corners[k, 2]
                node[k] = found
                found += 1
                break
            if points[j, 0] == x and points[j, 1] == y and points[j, 2] == z:
                node[k] = j
                break
            place = (place + np.uint64(1)) & last
    return len(corners), found


@part
def _is_zero(data, at, end):
    """Whether a number has no digit but zeros."""
    zero = True
    while at < end and data[at] | 32 != 101 and data[at] | 32 != 100:
        zero = zero and not 49 <= data[at] <= 57
        at += 1
    return zero


@kernel
def other_spellings(data, starts, ends, points, node, first, other):
    """Which corners (n × 3 tokens) may be other decimals than the first one of their node, as they are spelt otherwise.

    Zeros are told, and numbers of so few bytes that they have at most 15 digits, which float64 tells apart unless it
    runs out of small numbers. Fills other with the other corners and returns how many they are.
    """
    found = 0
    for k in range(len(node)):
        j = first[node[k]]
        same = True
        for axis in range(3):
            mine, its = starts[k, axis], starts[j, axis]
            length, other_length = ends[k, axis] - mine, ends[j, axis] - its
            value = points[node[k], axis]
            if value == 0.0 and _is_zero(data, mine, ends[k, axis]) and _is_zero(data, its, ends[j, axis]):
                continue
            if length > 15 or other_length > 15 or abs(value) < LEAST_NORMAL:
                same = same and length == other_length
                at = 0
                while same and at < length:
                    same = data[mine + at] == data[its + at]
                    at += 1
        if not same:
            other[found] = k
            found += 1
    return found


@kernel
def match_words(data, kinds, stop, starts, words, cuts):
    """Whether tokens are certain words, which repeat: word k, in lower case, is words[cuts[k] : cuts[k + 1]].

    A word of no letters stands for anything. Returns the number of the first token that is another, or -1.
    """
    size = len(cuts) - 1
    for k in range(len(starts)):
        begin, end = cuts[k % size], cuts[k % size + 1]
        if begin < end:
            at = np.int64(starts[k])
            for j in range(begin, end):
                if at >= stop or data[at] | 32 != words[j]:
                    return k
                at += 1
            if at < stop and kinds[data[at]] == 0:
                return k
    return -1

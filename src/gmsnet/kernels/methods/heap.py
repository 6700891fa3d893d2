"""A binary min-heap of the items 0 … n − 1, each of which may get another key at any time.

heap: (n,) int32 items, the children of slot s in the slots 2s + 1 and 2s + 2; place: (n,) int32, the slot of each item;
key: (n,) float64, the key of each item. Of equal keys the lower item comes first, so that the minimum item, heap[0],
does not depend on the order in which keys were changed.
"""

from __future__ import annotations

from gmsnet.kernels.jit.compile import part


@part
def build(heap, place, key):
    """Arranges all items by their keys."""
    for item in range(len(heap)):
        heap[item] = item
        place[item] = item
    for slot in range(len(heap) // 2 - 1, -1, -1):
        sink(heap, place, key, slot)


@part
def update(heap, place, key, item):
    """Puts an item where it belongs after its key has been lowered or raised."""
    rise(heap, place, key, place[item])
    sink(heap, place, key, place[item])


@part
def before(key, one, other):
    """Does one item come before another?"""
    return key[one] < key[other] or (key[one] == key[other] and one < other)


@part
def rise(heap, place, key, slot):
    """Exchanges the item of a slot with its parent for as long as it comes before it."""
    item = heap[slot]
    while slot > 0:
        parent = (slot - 1) // 2
        above = heap[parent]
        if not before(key, item, above):
            break
        heap[slot] = above
        place[above] = slot
        slot = parent
    heap[slot] = item
    place[item] = slot


@part
def sink(heap, place, key, slot):
    """Exchanges the item of a slot with the first of its children for as long as that comes before it."""
    item = heap[slot]
    while 2 * slot + 1 < len(heap):
        child = 2 * slot + 1
        if child + 1 < len(heap) and before(key, heap[child + 1], heap[child]):
            child += 1
        below = heap[child]
        if not before(key, below, item):
            break
        heap[slot] = below
        place[below] = slot
        slot = child
    heap[slot] = item
    place[item] = slot

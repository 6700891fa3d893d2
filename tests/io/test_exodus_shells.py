"""Sides of shells in Exodus II files: their faces come before their edges."""

from __future__ import annotations

import numpy as np
import pytest

from gmsnet.errors import FormatError
from gmsnet.io.exodus_elements import sides_of


def sides(kind, numbers):
    """The corners of each kept side of one element, and how many are not kept. numbers: counted from 1."""
    found, left = sides_of([(kind, 1)], np.zeros(len(numbers), dtype=int), np.array(numbers) - 1, 2)
    return sorted(side.corners for some in found.values() for side in some), left


def test_edges_of_shells_come_after_their_two_faces():
    assert sides("quad", [1, 2, 6]) == (sides("quad", [4])[0], 2)
    assert sides("quad", [3, 4, 5, 6])[0] == sides("quad", [1, 2, 3, 4])[0]
    assert sides("triangle", [1, 3, 5]) == (sides("triangle", [1, 3])[0], 1)
    for kind, number in (("triangle", 6), ("quad", 7), ("quad", 0)):
        with pytest.raises(FormatError, match=f"a side set names a side that a {kind} does not have"):
            sides(kind, [number])

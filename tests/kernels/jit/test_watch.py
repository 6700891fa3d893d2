"""What is compiled is counted: once, with what it calls, and not what is compiled already."""

import time

import numba
import pytest

from gmsnet.kernels.jit.watch import Compilation


def fresh():
    """A function that calls another, neither of them compiled."""

    @numba.njit
    def inner(x):
        return x + 1

    @numba.njit
    def outer(x):
        return inner(x) + inner(2 * x)

    return outer


def test_seconds_are_those_of_compilation():
    function, began = fresh(), time.perf_counter()
    with Compilation() as watched:
        assert function(3) == 11
        once = watched.seconds
        assert function(4) == 14
    assert 0.0 < once <= time.perf_counter() - began  # callees are not counted twice
    assert watched.seconds == once
    fresh()(5)
    assert watched.seconds == once


def test_the_first_is_told_once():
    told = []
    with Compilation(lambda: told.append(1)):
        assert told == []
        fresh()(3)
        fresh()(3)
    assert told == [1]


def test_what_cannot_be_compiled_is_no_open_end():
    @numba.njit
    def wrong(x):
        return x.nothing

    with Compilation() as watched:
        with pytest.raises(numba.TypingError):
            wrong(3)
        failed = watched.seconds
        time.sleep(0.05)
        assert watched.seconds == failed
        fresh()(3)
    assert watched.seconds > failed

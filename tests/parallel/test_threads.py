"""Work that is shared out to threads: each piece once, results in order, and nothing lost of what goes wrong."""

import itertools
import threading

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gmsnet.parallel.threads import FEWEST_BLOCKS, pieces, serial, side_by_side, workers

MANY = 100 * FEWEST_BLOCKS


@given(st.integers(0, 10**6), st.integers(0, 10**5), st.integers(2, 64))
def test_pieces_cover_a_range_and_none_is_small(first, count, threads):
    ends = pieces(first, first + count, threads)
    sizes = [end - begin for begin, end in itertools.pairwise(ends)]
    assert ends[0] == first
    assert ends[-1] == first + count
    assert sum(sizes) == count
    assert len(sizes) == 1 or min(sizes) >= FEWEST_BLOCKS
    assert all(size <= max(count / (2 * threads), 2 * FEWEST_BLOCKS) for size in sizes)


@pytest.mark.parametrize("threads", [1, 2, 3, 8])
def test_every_piece_is_worked_on_once_and_results_come_in_their_order(threads):
    seen = set()

    def work(first, last):
        seen.add(threading.get_ident())
        return list(range(first, last))

    with workers(threads, MANY) as share:
        for _ in range(20):
            assert list(itertools.chain(*share(work, 5, MANY))) == list(range(5, MANY))
    assert len(seen) <= threads


def test_little_work_stays_in_its_thread():
    with workers(2, 100) as share:
        assert share is serial
    with workers(1, MANY) as share:
        assert share is serial


@pytest.mark.parametrize("bad", [0, MANY - 1])
def test_what_goes_wrong_in_a_piece_is_raised(bad):
    def work(first, last):
        if first <= bad < last:
            raise ZeroDivisionError

    with workers(3, MANY) as share, pytest.raises(ZeroDivisionError):
        share(work, 0, MANY)


def test_after_an_interrupt_nobody_begins_another_piece():
    begun = []

    def work(first, last):
        begun.append(first)
        if threading.current_thread() is threading.main_thread():
            raise KeyboardInterrupt
        caller_is_through.wait(30)

    caller_is_through = threading.Event()
    with workers(3, MANY) as share:
        threading.Timer(0.2, caller_is_through.set).start()
        with pytest.raises(KeyboardInterrupt):
            share(work, 0, MANY)
    assert len(begun) <= 3 < len(pieces(0, MANY, 3)) - 1


@pytest.mark.parametrize("threads", [1, 2])
def test_two_works_side_by_side(threads):
    assert side_by_side(threads, lambda: "one", lambda: "other") == ("one", "other")
    for one, other in ((lambda: 1 // 0, int), (int, lambda: 1 // 0)):
        with pytest.raises(ZeroDivisionError):
            side_by_side(threads, one, other)


def test_side_by_side_means_at_the_same_time():
    both = threading.Barrier(2, timeout=30)
    side_by_side(2, both.wait, both.wait)

"""Work that is shared out to threads: each piece once, results in order, and nothing lost of what goes wrong."""

import itertools
import threading

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gmsnet.parallel.threads import FEWEST_BLOCKS, Threads, pieces, serial, side_by_side, workers

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

    with workers(threads) as executor:
        for _ in range(20):
            assert list(itertools.chain(*executor.map(work, 5, MANY))) == list(range(5, MANY))
    assert len(seen) <= threads


def test_little_work_stays_in_its_thread():
    with workers(2) as executor:
        assert executor.for_blocks(100) is serial
        assert executor.for_blocks(MANY) is executor
    with workers(1) as executor:
        assert executor is executor.for_blocks(MANY) is serial


@pytest.mark.parametrize("bad", [0, MANY - 1])
def test_what_goes_wrong_in_a_piece_is_raised(bad):
    def work(first, last):
        if first <= bad < last:
            raise ZeroDivisionError

    with workers(3) as executor:
        with pytest.raises(ZeroDivisionError):
            executor.map(work, 0, MANY)
        assert sum(executor.map(lambda first, last: last - first, 0, MANY)) == MANY, "it can be used again"


def test_after_an_interrupt_nobody_begins_another_piece_and_those_that_are_begun_have_ended():
    begun, ended = [], []

    def work(first, last):
        begun.append(first)
        if threading.current_thread() is threading.main_thread():
            raise KeyboardInterrupt
        caller_is_through.wait(30)
        ended.append(first)

    caller_is_through = threading.Event()
    with workers(3) as executor:
        threading.Timer(0.2, caller_is_through.set).start()
        with pytest.raises(KeyboardInterrupt):
            executor.map(work, 0, MANY)
        assert len(ended) == len(begun) - 1
    assert len(begun) <= 3 < len(pieces(0, MANY, 3)) - 1


@pytest.mark.parametrize("executor", [serial, Threads(3)])
def test_the_figures_of_one_process_are_those_of_the_whole_mesh(executor):
    figures = np.array([1.0, -2.5, np.inf])
    assert executor.minimum(0.1) == 0.1
    assert executor.minimum(figures) is executor.total(figures) is figures
    assert executor.after_colour(0, figures) is None


@pytest.mark.parametrize("threads", [1, 2])
def test_two_works_side_by_side(threads):
    assert side_by_side(threads, lambda: "one", lambda: "other") == ("one", "other")
    for one, other in ((lambda: 1 // 0, int), (int, lambda: 1 // 0)):
        with pytest.raises(ZeroDivisionError):
            side_by_side(threads, one, other)


def test_side_by_side_means_at_the_same_time():
    both = threading.Barrier(2, timeout=30)
    side_by_side(2, both.wait, both.wait)


@given(st.lists(st.sampled_from([-1.0, 0.0, 0.5, 1.0]) | st.floats(-1, 1)), st.integers(1, 30))
def test_the_nth_value_is_as_sorting_says(values, number):
    given_values = np.array(values)
    assert serial.nth(given_values, number) == (sorted(values)[min(number, len(values)) - 1] if values else np.inf)
    np.testing.assert_array_equal(given_values, values)

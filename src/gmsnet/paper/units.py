"""Units of work: done in processes of their own, side by side or alone, and skipped where their results are there."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from multiprocessing.synchronize import Event
from pathlib import Path
from typing import Any

from gmsnet.errors import InputError
from gmsnet.paper.plan import Plan
from gmsnet.paper.store import Result, Store
from gmsnet.parallel.threads import available_threads

MOST_PROCESSES = 8
LOOK = 0.2  # seconds between two looks at whether to stop

GRACE = 20.0  # seconds that a process has to give up its unit once it is told to end

_stop: Event | None = None  # of the process that does the work
_ending = False  # it was told to end by a signal


class Stopped(Exception):
    """The reproduction is to stop: the unit in work is given up."""


@dataclass(frozen=True)
class Context:
    """What a unit may use besides its arguments: the plan, and the results of earlier units."""

    plan: Plan
    store: Store

    @property
    def stopping(self) -> bool:
        """Whether to stop; units that take more than a second or two ask now and then."""
        return _ending or (_stop is not None and _stop.is_set())

    def go_on(self) -> None:
        """Raises Stopped if the reproduction is to stop."""
        if self.stopping:
            raise Stopped


@dataclass(frozen=True)
class Unit:
    """name: of its result in the store. work(context, **arguments): a function of a module."""

    name: str
    work: Callable[..., Result]
    arguments: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Batch:
    """Units that may be done side by side, or, if ``alone``, one after another: because they are timed."""

    title: str
    units: Sequence[Unit]
    alone: bool = False


@dataclass(frozen=True)
class UnitsDone:
    """How far a reproduction is: so many of all units are there; a unit of this batch was the last."""

    done: int
    total: int
    batch: str


def missing(batches: Sequence[Batch], store: Store) -> list[Batch]:
    """The batches with those units whose results are not in the store."""
    left = [Batch(s.title, [unit for unit in s.units if not store.holds(unit.name)], s.alone) for s in batches]
    return [batch for batch in left if batch.units]


def carry_out(
    batches: Sequence[Batch],
    plan: Plan,
    store: Store,
    on_unit: Callable[[UnitsDone], None],
    should_stop: Callable[[], bool],
) -> bool:
    """Does what is missing, a batch after the other; tells whether all is there now.

    on_unit: called at the start of each batch and after each unit. should_stop: asked all the time; once it is true,
    units in work are given up (a training leaves its checkpoint), and all finished ones stay.
    Raises what a unit raises, and InputError where a process is killed; finished units stay then, too.
    """
    total = sum(len(batch.units) for batch in batches)
    left = missing(batches, store)
    done = total - sum(len(batch.units) for batch in left)
    if not left:
        return True
    method = multiprocessing.get_context("spawn")  # a fork of a process with threads may hang
    stop = method.Event()
    processes = min(available_threads(), MOST_PROCESSES)
    with ProcessPoolExecutor(processes, mp_context=method, initializer=_prepare, initargs=(stop,)) as pool:
        try:
            for batch in left:
                on_unit(UnitsDone(done, total, batch.title))
                abreast = 1 if batch.alone else processes
                waiting, running = list(batch.units), set[Future[bool]]()
                while waiting or running:
                    if should_stop():
                        stop.set()
                        waiting = []
                    while waiting and len(running) < abreast:
                        running.add(pool.submit(_do, waiting.pop(0), plan, store.folder))
                    finished, running = wait(running, timeout=LOOK, return_when=FIRST_COMPLETED)
                    for each in finished:
                        done += each.result()
                        on_unit(UnitsDone(done, total, batch.title))
                if stop.is_set():
                    return False
        except BrokenProcessPool as error:
            raise InputError(
                f"a process of the batch '{batch.title}' ended abruptly (is there too little memory?); "
                f"{store.folder} keeps what is done: the same command goes on with it"
            ) from error
        except BaseException:
            stop.set()
            raise
    return True


def _prepare(stop: Event) -> None:
    """In a new process: one thread, and signals are the parent's affair (a terminal sends them to all).

    A unit in work is given up at the signal to end, and the process does not outlive its parent.
    """
    global _stop
    _stop = stop
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _give_up)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    for name in ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ[name] = "1"  # read when the libraries are loaded, which is later


def _give_up(*_: Any) -> None:
    global _ending
    _ending = True
    timer = threading.Timer(GRACE, os._exit, [1])
    timer.daemon = True
    timer.start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _do(unit: Unit, plan: Plan, folder: Path) -> bool:
    """Does a unit and keeps its result, unless it was given up; tells whether it is there."""
    store = Store(folder)
    began = time.perf_counter()
    try:
        result = unit.work(Context(plan, store), **unit.arguments)
    except Stopped:
        return False
    store.save(unit.name, result, time.perf_counter() - began)
    return True

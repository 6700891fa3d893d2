"""Units of work: done once, whatever happens, in processes of their own."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from support import reproduce_work as work

from gmsnet.errors import InputError
from gmsnet.paper.plan import Plan
from gmsnet.paper.store import Result, Store
from gmsnet.paper.units import Batch, Unit, UnitsDone, carry_out, missing

PLAN = Plan(runs=1, sweeps=1, seed=0, quick=True)


@pytest.fixture
def store(tmp_path) -> Store:
    made = Store(tmp_path / "out")
    made.open(PLAN.fingerprint())
    return made


def notes(*texts: str) -> list[Unit]:
    return [Unit(f"note/{text}", work.note, {"text": text}) for text in texts]


def do(batches, store, should_stop=lambda: False) -> tuple[bool, list[UnitsDone]]:
    records: list[UnitsDone] = []
    return carry_out(batches, PLAN, store, records.append, should_stop), records


def test_stages_follow_one_another_and_results_are_kept(store):
    batches = [
        Batch("alone", notes("a", "b"), alone=True),
        Batch("together", notes("c", "d")),
        Batch("after", [Unit("sum", work.add, {"names": ["note/d", "note/a"]})]),
    ]
    finished, records = do(batches, store)
    assert finished
    assert store.load("sum") == {"text": "da"}
    assert store.load("note/a")["process"] != os.getpid()
    assert (store.folder / "notes/c.txt").read_text() == "c"
    assert store.seconds("sum") >= 0
    assert records[0] == UnitsDone(0, 5, "alone")
    assert records[-1] == UnitsDone(5, 5, "after")
    assert [each.done for each in records] == sorted(each.done for each in records)


def test_what_is_there_is_not_done_again(store):
    assert do([Batch("first", notes("a"))], store)[0]
    kept = (store.folder / "units/note/a.json").read_bytes()
    both = [Batch("first", notes("a", "b"))]
    assert [unit.name for batch in missing(both, store) for unit in batch.units] == ["note/b"]
    finished, records = do(both, store)
    assert finished
    assert records[0] == UnitsDone(1, 2, "first")
    assert (store.folder / "units/note/a.json").read_bytes() == kept
    assert do(both, store) == (True, [])


def test_a_stop_gives_up_what_is_in_work_and_keeps_the_rest(store):
    batches = [Batch("first", notes("a")), Batch("second", [Unit("endless", work.endless), *notes("b")], alone=True)]
    finished, records = do(batches, store, lambda: store.holds("note/a"))
    assert not finished
    assert records[-1].done <= 1
    assert store.holds("note/a")
    assert not store.holds("endless")
    assert not store.holds("note/b")
    batches = [batches[0], Batch("second", notes("b"))]
    assert do(batches, store)[0]


def test_an_error_comes_through_and_what_was_done_stays(store):
    with pytest.raises(InputError, match="no triangles"):
        do([Batch("first", notes("a")), Batch("second", [Unit("fails", work.fail), *notes("b")], alone=True)], store)
    assert store.holds("note/a")
    assert not store.holds("fails")
    assert not store.holds("note/b")


def test_a_process_that_is_killed_is_told_plainly(store):
    """In a program of its own: what dies there must not be what runs the tests."""
    tests = str(Path(__file__).parents[1])
    found = os.pathsep.join(filter(None, [tests, os.environ.get("PYTHONPATH")]))
    done = subprocess.run(
        [sys.executable, "-m", "support.reproduce_work", str(store.folder)],
        env={**os.environ, "PYTHONPATH": found}, capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    assert done.returncode == 1, done.stderr
    assert re.search(r"InputError: .*of the batch 'second' ended abruptly .* keeps what is done", done.stderr)
    assert store.holds("note/a")
    assert not store.holds("dies")


def test_processes_use_one_thread(store, monkeypatch):
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        monkeypatch.setenv(name, "2")
    assert do([Batch("first", [Unit("threads", work.threads)])], store)[0]
    assert store.load("threads") == {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}


def test_a_folder_is_claimed_by_one_set_of_options(store):
    store.open(PLAN.fingerprint())
    other = Plan(runs=2, sweeps=1, seed=0, quick=True).fingerprint()
    with pytest.raises(InputError, match=r"other options \(runs 1 there, 2 here\); take another --out"):
        store.open(other)
    weights = PLAN.fingerprint() | {"weights": {"gmsnet-h8.safetensors": "0"}}
    with pytest.raises(InputError, match="made with other weights"):
        store.open(weights)


def test_folders_that_cannot_be_used(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be made"):
        Store(tmp_path / "file" / "out").open(PLAN.fingerprint())
    with pytest.raises(InputError, match="cannot be made"):
        Store(tmp_path / "file").open(PLAN.fingerprint())


def test_damaged_results_are_named(store):
    assert do([Batch("first", notes("a"))], store)[0]
    path = store.folder / "units/note/a.json"
    path.write_text(path.read_text()[:20])
    with pytest.raises(InputError, match=r"a\.json: cannot be read .* delete it, and it is made anew"):
        store.load("note/a")
    with pytest.raises(KeyError):
        store.load("note/b")


def test_numbers_that_are_not_finite_become_null(store):
    store.save("odd", Result({"values": [1.0, float("inf"), float("nan")]}), 0.0)
    assert store.load("odd") == {"values": [1.0, None, None]}
    assert json.loads((store.folder / "units/odd.json").read_text())["unit"] == "odd"


@pytest.mark.parametrize(("name", "value"), [("runs", 0), ("sweeps", 0), ("seed", -1)])
def test_plans_out_of_range(name, value):
    with pytest.raises(InputError, match=f"--{name} must be at least"):
        Plan(**({"runs": 1, "sweeps": 1, "seed": 0, "quick": False} | {name: value}))


def test_the_ordinary_plan_is_the_papers():
    assert Plan.of(None, None, 0, quick=False) == Plan(10, 100, 0, False)
    assert Plan.of(3, None, 0, quick=True) == Plan(3, 20, 0, True)


def test_a_result_whose_file_is_gone_is_made_anew(store):
    store.save("drawn", Result({}, {"figures/one.png": b"picture"}), 1.0)
    assert store.holds("drawn")
    (store.folder / "figures" / "one.png").unlink()
    assert not store.holds("drawn")


def test_results_without_their_options_are_not_adopted(store):
    store.save("one", Result({}), 1.0)
    (store.folder / "options.json").unlink()
    with pytest.raises(InputError, match="not with which options"):
        store.open(PLAN.fingerprint())


@pytest.mark.parametrize("content", ['{"a": 1}', "[1]", "{"])
def test_a_file_that_is_no_result_is_told_with_its_mend(store, content):
    store.path("one").parent.mkdir(parents=True, exist_ok=True)
    store.path("one").write_text(content)
    with pytest.raises(InputError, match=r"one\.json: .*delete it, and it is made anew"):
        store.load("one")

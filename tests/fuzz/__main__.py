"""Hunts for files that break a promise of the readers: ``PYTHONPATH=tests python -m fuzz --seconds 60``.

Needs Atheris (``pip install atheris``). Prints for each format how many files were tried, how many lines of gmsnet.io
they reach, and what was found; exits 1 where anything was.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tempfile
import time
from functools import partial
from pathlib import Path

from fuzz.corpus import name_of, store, stored
from fuzz.lines import lines, smallest, ways
from fuzz.promises import examine
from gmsnet.io.formats import FORMATS

LONGEST = 1 << 14  # bytes of a file that is tried
AT_ONCE = 3000  # files that one worker tries: Atheris does not let go of what a mutator of ours has returned


def options() -> argparse.Namespace:
    """What the command line says."""
    parser = argparse.ArgumentParser(prog="python -m fuzz", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--formats", default=",".join(FORMATS), help="names of formats, separated by commas")
    parser.add_argument("--seconds", type=int, default=0, help="for each format (default: until --executions are done)")
    parser.add_argument("--executions", type=int, default=10_000, help="for each format (default: %(default)s; 0: any)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--findings", type=Path, default=Path("findings"), help="folder for what is found")
    parser.add_argument("--grow", action="store_true", help="put new ways into the corpus, and minimise it")
    parser.add_argument("--seeds", action="store_true", help="begin with the seeds too (needs VTK)")
    return parser.parse_args()


def hunt(key: str, folder: Path, given: argparse.Namespace) -> tuple[int, float]:
    """Runs the worker on the corpus in a folder until enough is done. Returns the executions and the seconds."""
    done, start, round_ = 0, time.monotonic(), 0
    while True:
        left = min(given.executions - done, AT_ONCE) if given.executions else AT_ONCE
        time_left = given.seconds - int(time.monotonic() - start) if given.seconds else 0
        if left == 0 or (given.seconds and time_left <= 0):
            return done, time.monotonic() - start
        command = [
            sys.executable, "-m", "fuzz.worker", key, str(given.findings), f"-runs={left}",
            f"-max_total_time={time_left}", f"-seed={given.seed + round_}", f"-max_len={LONGEST}", "-len_control=0",
            "-timeout=10", "-rss_limit_mb=0", "-print_final_stats=1", "-reload=0", "-reduce_inputs=0",
            f"-artifact_prefix={given.findings}/{key}-", str(folder),
        ]  # fmt: skip
        run = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace")
        counted = re.search(r"stat::number_of_executed_units:\s*(\d+)", run.stdout)
        if counted is None or (run.returncode and "Test unit written" not in run.stdout):
            raise SystemExit(f"the worker failed:\n{run.stdout[-4000:]}")
        done += int(counted[1])
        if run.returncode:  # a crash of the process, a hang: libFuzzer has kept the file
            (given.findings / f"{key}-{round_}.log").write_text(run.stdout[-8000:])
        round_ += 1


def main() -> int:
    """The hunts one after another, and a line for each."""
    given = options()
    given.findings.mkdir(parents=True, exist_ok=True)
    total, reached, trouble = 0, set[tuple[str, int]](), 0
    for key in given.formats.split(","):
        with tempfile.TemporaryDirectory() as name:
            folder, scratch = Path(name) / "corpus", Path(name) / "scratch"
            folder.mkdir()
            scratch.mkdir()
            begin = stored(key)
            if given.seeds:
                from fuzz.seeds import seeds_of

                begin += seeds_of(key)
                store(key, begin)
            for data in begin:
                (folder / name_of(data)).write_bytes(data)
            done, seconds = hunt(key, folder, given)
            taken = {
                data: ways(partial(examine, key, data, scratch))
                for data in {path.read_bytes() for path in folder.iterdir()}
            }
            if given.grow:
                size = store(key, smallest(taken))
                print(f"{key}: the corpus has {len(stored(key))} files, {size} bytes")
        found = len(list(given.findings.glob(f"{key}-*")))
        here = lines(set().union(*taken.values()))
        total, reached, trouble = total + done, reached | here, trouble + found
        rate = done / max(seconds, 1e-9)
        print(
            f"{key}: {done} executions, {rate:.0f} a second, {len(here)} lines, {found} files of findings", flush=True
        )
    print(
        f"all: {total} executions, {len(reached)} lines of gmsnet.io, {trouble} files of findings in {given.findings}"
    )
    return int(trouble > 0)


if __name__ == "__main__":
    raise SystemExit(main())

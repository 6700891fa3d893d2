"""The hunt in one format, in a process of its own: Atheris (libFuzzer) mutates files and looks where they lead.

Run by ``python -m fuzz``: ``python -m fuzz.worker KEY FINDINGS`` and the arguments of libFuzzer.
"""

from __future__ import annotations

import os
import resource
import sys
import tempfile
import traceback
from pathlib import Path
from random import Random

import atheris

import gmsnet.kernels.text.text
import gmsnet.kernels.topology.weld  # noqa: F401 - kernels are compiled as they are, before anything is instrumented

with atheris.instrument_imports(include=["gmsnet.io"]):
    from fuzz.corpus import name_of, stored
    from fuzz.mutations import mutate
    from fuzz.promises import MEMORY, Broken, examine, parts
    from gmsnet.io.formats import FORMATS

    for _entry in FORMATS.values():
        _entry.load()

ROOM = 10 * MEMORY  # address space beyond what the process has once all is compiled; Atheris leaks some of it

MOST_GOOD = 1000  # files that read


def place_of(error: BaseException) -> str:
    """What was raised and where: findings of the same place are one."""
    what = str(error).split(":")[0] if isinstance(error, Broken) else type(error).__name__
    while error.__context__ is not None:  # a message that is no good: where it comes from
        error = error.__context__
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if "/gmsnet/io" in frame.filename]
    where = f"{Path(frames[-1].filename).name}:{frames[-1].lineno}" if frames else ""
    return f"{what} {where}".strip()


def main(key: str, findings: Path, arguments: list[str]) -> None:
    """Hunts until libFuzzer's arguments say that it is enough; each finding is kept as a file with its traceback."""
    shared = Path("/dev/shm")
    known, good, seen = stored(key), list[bytes](), set[str]()
    with tempfile.TemporaryDirectory(dir=shared if os.access(shared, os.W_OK) else None) as name:
        folder = Path(name)

        def visit(data: bytes) -> None:
            try:
                if not examine(key, data, folder) and len(good) < MOST_GOOD:
                    good.append(data)
            except Exception as error:  # whatever it is: that is what the hunt is for
                place = place_of(error)
                if place not in seen:
                    seen.add(place)
                    stem = findings / f"{key}-{name_of(place.encode())}"
                    for suffix, part in parts(key, data).items():
                        Path(f"{stem}{suffix}" if suffix.startswith(".") else f"{stem}-{suffix}").write_bytes(part)
                    stem.with_suffix(".txt").write_text(f"{place}\n\n{traceback.format_exc()}")
                    stem.with_suffix(".input").write_bytes(data)

        for data in known:  # compiles what there is to compile
            visit(data)
        pages = int(Path("/proc/self/statm").read_text().split()[0]) if Path("/proc/self/statm").exists() else 0
        if pages:
            room = pages * resource.getpagesize() + ROOM
            resource.setrlimit(resource.RLIMIT_AS, (room, room))

        def mutator(data: bytes, most: int, seed: int) -> bytes:
            random = Random(seed)
            if random.random() < 0.1:
                return bytes(atheris.Mutate(data, most))
            if good and random.random() < 0.4:  # what reads leads further than what is refused
                data = random.choice(good)
            return mutate(data, random, known, most)

        atheris.Setup([sys.argv[0], *arguments], visit, custom_mutator=mutator)
        atheris.Fuzz()


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]), sys.argv[3:])

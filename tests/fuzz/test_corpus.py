"""Replays the corpus, and a few thousand files that are made of it by damage, the same each time."""

from __future__ import annotations

from pathlib import Path
from random import Random

import pytest

from fuzz.corpus import stored
from fuzz.mutations import mutate
from fuzz.promises import examine
from gmsnet.io.formats import FORMATS

TRIES = 400  # for each format


@pytest.mark.parametrize("key", FORMATS)
def test_the_corpus_keeps_the_promises(key: str, tmp_path: Path) -> None:
    said = [examine(key, data, tmp_path) for data in stored(key)]
    assert "" in said, "no file of the corpus reads"
    assert len(set(said)) > 5, "the corpus is too small to be of use"


@pytest.mark.parametrize("key", FORMATS)
def test_damage_breaks_no_promise(key: str, tmp_path: Path) -> None:
    files, random, read = stored(key), Random(key), 0
    good = [data for data in files if not examine(key, data, tmp_path)]
    for k in range(TRIES):
        data = mutate(random.choice(good if k % 2 else files), random, files, 1 << 14)
        (tmp_path / "input").write_bytes(data)  # what to look at if this fails
        read += not examine(key, data, tmp_path)
    assert read, "all damage is refused: the other promises were not tried"

"""The corpus: for each format one archive of small files that between them take every way through its reader."""

from __future__ import annotations

import hashlib
import zipfile
from collections.abc import Iterable
from pathlib import Path

FOLDER = Path(__file__).parent / "corpus"


def stored(key: str) -> list[bytes]:
    """The files of a format's corpus; none where there is no corpus yet."""
    path = FOLDER / f"{key}.zip"
    if not path.exists():
        return []
    with zipfile.ZipFile(path) as archive:
        return [archive.read(name) for name in sorted(archive.namelist())]


def store(key: str, files: Iterable[bytes]) -> int:
    """Writes the corpus of a format, the same bytes for the same files. Returns the length of the archive."""
    FOLDER.mkdir(exist_ok=True)
    path = FOLDER / f"{key}.zip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name, data in sorted((name_of(data), data) for data in set(files)):
            archive.writestr(zipfile.ZipInfo(name), data, zipfile.ZIP_DEFLATED, 9)
    return path.stat().st_size


def name_of(data: bytes) -> str:
    """The name that a file has in the corpus and among the findings."""
    return hashlib.sha256(data).hexdigest()[:16]

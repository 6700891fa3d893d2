"""A folder that holds the results of units of work, one file each: a reproduction can be stopped and resumed."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from gmsnet.errors import InputError
from gmsnet.io.atomic import check_writable, reason, replace_files

OPTIONS = "options.json"
UNITS = "units"
ANEW = "delete it, and it is made anew"


@dataclass(frozen=True)
class Result:
    """What a unit of work found: plain values, and files by their path in the folder."""

    values: Mapping[str, Any]
    files: Mapping[str, bytes] = field(default_factory=dict)


@dataclass(frozen=True)
class Store:
    """The folder of one reproduction. A result is either there, whole, or not at all."""

    folder: Path

    def open(self, fingerprint: Mapping[str, Any]) -> None:
        """Makes the folder if it is not there, and claims it for results with this fingerprint.

        Raises InputError where nothing can be written, and where it holds results of other options.
        """
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"{self.folder}: this folder cannot be made: {reason(error)}") from error
        options = self.folder / OPTIONS
        check_writable(str(options))
        if (self.folder / UNITS).exists() and not options.exists():
            raise InputError(
                f"{self.folder}: holds results, but not with which options ({OPTIONS}); take another --out"
            )
        if options.exists():
            held = _read(options, "take another --out")
            if held != fingerprint:
                raise InputError(
                    f"{self.folder}: holds a reproduction with other options ({_difference(held, fingerprint)}); "
                    "take another --out, or the same options to go on with it"
                )
            return
        self._write({options: dumps(fingerprint)})

    def holds(self, name: str) -> bool:
        """Is the result of this unit there, with its files?"""
        path = self.path(name)
        return path.exists() and all((self.folder / each).exists() for each in _read(path).get("files", []))

    def save(self, name: str, result: Result, seconds: float) -> None:
        """Keeps the result of a unit, its files first. seconds: that it took."""
        contents = {self.folder / path: content for path, content in result.files.items()}
        head = {"unit": name, "seconds": seconds, "files": list(result.files)}
        contents[self.path(name)] = dumps({**head, "result": result.values})
        self._write(contents)

    def load(self, name: str) -> dict[str, Any]:
        """The values of a unit. Raises InputError if its file is damaged; KeyError if it is not there."""
        if not self.holds(name):
            raise KeyError(name)
        values = _read(self.path(name)).get("result")
        if not isinstance(values, dict):
            raise InputError(f"{self.path(name)}: is no result of gmsnet reproduce; {ANEW}")
        return values

    def seconds(self, name: str) -> float:
        """How long a unit took."""
        return float(_read(self.path(name)).get("seconds", math.nan))

    def write(self, files: Mapping[str, bytes]) -> None:
        """Writes files by their path in the folder."""
        self._write({self.folder / path: content for path, content in files.items()})

    def path(self, name: str) -> Path:
        """Of the file with the result of a unit."""
        return self.folder / UNITS / f"{name}.json"

    def _write(self, contents: Mapping[Path, bytes]) -> None:
        for path in contents:
            try:
                path.parent.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                raise InputError(f"{path.parent}: this folder cannot be made: {reason(error)}") from error
        replace_files({str(path): content for path, content in contents.items()})


def strict(value: Any) -> Any:
    """The value with None for each number that is not finite, which JSON does not know."""
    if isinstance(value, Mapping):
        return {str(key): strict(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [strict(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def dumps(document: Mapping[str, Any]) -> bytes:
    """Strict JSON."""
    return (json.dumps(strict(document), indent=1, allow_nan=False) + "\n").encode()


def _read(path: Path, mend: str = ANEW) -> dict[str, Any]:
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read ({error}); {mend}") from error
    if not isinstance(document, dict):
        raise InputError(f"{path}: is no result of gmsnet reproduce; {mend}")
    return document


def _difference(held: Mapping[str, Any], wanted: Mapping[str, Any]) -> str:
    """In which options two fingerprints differ, in words."""
    names = [name for name in {**held, **wanted} if held.get(name) != wanted.get(name)]
    if names == ["weights"]:
        return "made with other weights"
    return ", ".join(f"{name} {held.get(name)} there, {wanted.get(name)} here" for name in names if name != "weights")

"""Several files in one call: which they are, where each goes, and that one that fails does not stop the others."""

from __future__ import annotations

import glob
import os
from collections.abc import Callable, Sequence
from typing import NamedTuple

import typer

from gmsnet.cli.failure import BAD_INPUT, BUG, DONE, print_failure, told
from gmsnet.cli.signals import Interrupted
from gmsnet.errors import InputError
from gmsnet.io.foam_case import MESH, mesh_folder
from gmsnet.io.formats import BY_SUFFIX, FORMATS, entry_of, known
from gmsnet.io.packed import split_name
from gmsnet.io.paths import files_of
from gmsnet.io.split_files import group_of
from gmsnet.io.streams import STANDARD_INPUT
from gmsnet.mesh.display import amount


class Job(NamedTuple):
    """One file of several. number: how it is counted, as "[2/7] "."""

    source: str
    output: str
    number: str


def only_output(others: Sequence[str], out_dir: str | None, given: Sequence[str]) -> str | None:
    """OUT of a call for one file, which is the one file beside IN; None of a call for several.

    given: options that are for one file, of those that were given.

    Raises InputError for these with several files, and for several without a folder.
    """
    if out_dir is None:
        if len(others) > 1:
            raise InputError("several inputs need a folder to be written to: give --out-dir FOLDER")
        return others[0] if others else None
    if given:
        raise InputError(f"{given[0]} is for one file: leave it out, or leave out --out-dir")
    return None


def jobs_of(
    names: Sequence[str], out_dir: str, output_format: str | None, *, dry_run: bool, read_as: str | None = None
) -> list[Job]:
    """The files that are named, by themselves, by their folders or by patterns, and where each is written.

    The folder is made, unless the run is dry. Raises InputError where it cannot be, where there are no files, and where
    two of them would be written to the same place.
    """
    if os.path.exists(out_dir) and not os.path.isdir(out_dir):
        raise InputError(f"--out-dir {out_dir}: this is not a folder")
    sources = list(dict.fromkeys(path for name in names for path in _expanded(name)))
    places: dict[str, str] = {}
    jobs = []
    for number, source in enumerate(sources, 1):
        output = os.path.join(out_dir, _name(source, output_format))
        key = output_format or BY_SUFFIX.get(os.path.splitext(output)[1].lower())
        for written in [output, *(files_of(output, FORMATS[key]) if key in FORMATS else ())]:
            other = places.setdefault(written, source)
            if other != source:
                raise InputError(f"{other} and {source} would both be written to {written}: smooth them one by one")
        jobs.append(Job(source, output, f"[{number}/{len(sources)}] "))
    if not dry_run:
        os.makedirs(out_dir, exist_ok=True)
        for job in jobs:
            for folder in _folders(job.source, read_as) if output_format is None else ():
                os.makedirs(os.path.join(job.output, folder), exist_ok=True)
    return jobs


def _is_case(name: str) -> bool:
    """Whether a path is the folder of an OpenFOAM case, decomposed or not, or of its mesh."""
    return os.path.isdir(name) and (mesh_folder(name) is not None or group_of(name) is not None)


def _folders(name: str, read_as: str | None) -> list[str]:
    """The folders of the mesh in a case of OpenFOAM, from that of the case; none where a path leads to none."""
    if os.path.isdir(name) and (group := group_of(name, read_as)) is not None:
        return list(dict.fromkeys(map(os.path.dirname, group.keys)))
    return [MESH] if os.path.isdir(name) and mesh_folder(name) is not None else []


def _name(source: str, output_format: str | None) -> str:
    """The name of the output in its folder. A case keeps its name, and its mesh alone is written there."""
    if _is_case(source):
        case = os.path.basename(os.path.abspath(source).removesuffix(os.sep + MESH))
        return case + (entry_of(output_format).suffixes[0] if output_format else "")
    name = os.path.basename(source)
    return name if output_format is None else os.path.splitext(name)[0] + entry_of(output_format).suffixes[0]


def _expanded(name: str) -> list[str]:
    if name in STANDARD_INPUT:
        raise InputError("--out-dir is for files: the standard input has no name to write it by")
    if os.path.isdir(name):
        suffixes = {entry.suffixes[0] for entry in FORMATS.values()}  # of pairs of files the one with the nodes
        inside = sorted(os.path.join(name, each) for each in os.listdir(name))
        found = [path for path in inside if split_name(path)[1].lower() in suffixes and os.path.isfile(path)]
        if not found and _is_case(name):
            return [name]
        if not found:
            raise InputError(f"{name}: there are no mesh files in this folder ({known()})")
        return found
    if not os.path.exists(name) and glob.has_magic(name):  # where the shell has left it as it is
        if found := sorted(glob.glob(name)):
            return found
        raise InputError(f"{name}: no file has such a name")
    if not os.path.exists(name) and name.endswith(("/", os.sep)):
        raise InputError(f"{name}: there is no such folder")
    return [name]


def carry_out_each(
    jobs: Sequence[Job], one: Callable[[Job], tuple[int, bool]], fail: Callable[[Job, str], None], *, quiet: bool
) -> None:
    """Does all jobs one after the other and raises Exit with the worst of their exit codes, unless all are done.

    one: does a job; its exit code, and whether it was interrupted, which ends the others. fail: tells of an error
    besides standard error. quiet: no line at the end that counts.
    """
    codes = []
    for done, job in enumerate(jobs, 1):
        try:
            code, interrupted = one(job)
        except (BrokenPipeError, Interrupted):
            raise
        except Exception as error:
            code, interrupted = print_failure(error), False
            fail(job, told(error)[0])
        codes.append(code)
        if interrupted:
            raise Interrupted(f"interrupted; {amount(len(jobs) - done, 'file')} of {len(jobs)} not begun")
    if not quiet:
        counts = {"done": codes.count(DONE), "with cells that miss what was asked for": codes.count(1)}
        counts["failed"] = codes.count(BAD_INPUT) + codes.count(BUG)
        typer.echo(f"{amount(len(jobs), 'file')}: {', '.join(f'{n} {what}' for what, n in counts.items() if n)}")
    if max(codes) != DONE:
        raise typer.Exit(max(codes))

"""An installed gmsnet as others see it: the metadata that name its entry points, beside the sources."""

from __future__ import annotations

import os
import re
from pathlib import Path

ROOT = Path(__file__).parents[2]


def groups() -> dict[str, dict[str, str]]:
    """Group → name → object, as pyproject.toml has them. (Python 3.10 has no parser of TOML.)"""
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    found: dict[str, dict[str, str]] = {}
    for group, body in re.findall(r'^\[project\.entry-points\."([^"]+)"\][^\n]*\n((?:[^\[\n][^\n]*\n)*)', text, re.M):
        found[group] = dict(re.findall(r'^"?([^"\s=]+)"? = "([^"]+)"$', body, re.M))
    return found


def installed(folder: Path) -> dict[str, str]:
    """The environment of a process that finds the sources, and metadata of them written to this folder."""
    metadata = folder / "gmsnet-0.1.0.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: gmsnet\nVersion: 0.1.0\n")
    lines = [f"[{group}]\n" + "".join(f"{n} = {v}\n" for n, v in names.items()) for group, names in groups().items()]
    (metadata / "entry_points.txt").write_text("\n".join(lines))
    return {**os.environ, "PYTHONPATH": os.pathsep.join([str(folder), str(ROOT / "src")])}

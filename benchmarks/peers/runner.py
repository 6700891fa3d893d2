"""Starts a process for each tool and mesh, and takes what it found."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from peers.peer import Peer

FOLDER = Path(__file__).parents[1]
LIBRARIES = ("OMP", "OPENBLAS", "MKL", "NUMBA", "TBB")
ONE_THREAD = {f"{library}_NUM_THREADS": "1" for library in LIBRARIES}
SHOWN = 300  # characters of what a process said last


def versions(peer: Peer) -> dict[str, str]:
    """Of the distributions that a tool needs. Raises PackageNotFoundError for the first that is not there."""
    return {name: version(name) for name in peer.packages}


def run_peer(
    peer: Peer, mesh: Path, small: Path, nodes: int, options: dict[str, Any], module: str = "peers.worker"
) -> dict[str, Any]:
    """The record of a tool on a mesh: what was measured, or in ``status`` and ``reason`` why nothing was."""
    try:
        found: dict[str, Any] = {"versions": versions(peer)}
    except PackageNotFoundError as error:
        return {"status": "not installed", "reason": f"there is no {error.name}"}
    if peer.program and shutil.which(os.environ.get(peer.program, "")) is None:
        return {"status": "not installed", "reason": f"{peer.program} names no program"}
    if nodes > peer.most_nodes:
        return found | {"status": "left out", "reason": f"above {peer.most_nodes:,.0f} nodes it takes too long"}
    job = {"peer": peer.name, "mesh": str(mesh), "small": str(small)}
    job |= {name: options[name] for name in ("repeats", "patience")}
    return found | in_a_process(module, job, ONE_THREAD, options["limit"], Path(options["folder"]))


def in_a_process(
    module: str, job: dict[str, Any], environment: dict[str, str], limit: float, folder: Path
) -> dict[str, Any]:
    """What ``python -m module`` writes about a job; where it fails or takes too long, that."""
    order, answer, said = (folder / f"{module}.{end}" for end in ("job.json", "json", "log"))
    order.write_text(json.dumps(job), encoding="utf-8")
    answer.unlink(missing_ok=True)
    with said.open("w") as log:
        process = subprocess.Popen(
            [sys.executable, "-m", module, order.resolve(), answer.resolve()], cwd=FOLDER, stdout=log,
            stderr=subprocess.STDOUT, env={**os.environ, **environment},
        )  # fmt: skip
        try:
            code = process.wait(limit)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
            return {"status": "too slow", "reason": f"not done after {limit:,.0f} s"}
    if code != 0 or not answer.exists():
        last = said.read_text(errors="replace").strip().splitlines()[-1:]
        return {"status": "failed", "reason": f"exit code {code}: {' '.join(last)[:SHOWN]}"}
    return {"status": "measured", **json.loads(answer.read_text(encoding="utf-8"))}

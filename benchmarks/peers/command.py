"""The command: measures what is asked for, keeps the results, writes tables and plots."""

from __future__ import annotations

import argparse
import datetime
import json
import os
import shutil
from pathlib import Path
from typing import Any

from machine import describe

from peers.checks import figures
from peers.meshes import NAMES, stored
from peers.peer import Peer, Plane
from peers.plots import draw
from peers.report import markdown
from peers.runner import in_a_process, run_peer
from peers.table import ABSENT, OWN, PEERS

SMALL = 1000  # nodes of the mesh to warm up with
THREADED = (OWN[0], OWN[1], OWN[3])
BEGIN, END = "<!-- peers: made by benchmarks/peers.py -->", "<!-- peers: end -->"


def main() -> None:
    parser = argparse.ArgumentParser(description="gmsnet against other tools (peers/__init__.py says how).")
    parser.add_argument("--nodes", nargs="+", type=float, default=[1e4, 1e5])
    parser.add_argument("--meshes", nargs="+", choices=list(NAMES), default=list(NAMES))
    parser.add_argument("--peers", nargs="+", metavar="NAME", help="only tools whose name contains one of these")
    parser.add_argument("--repeats", type=int, default=5, help="runs with each effort, at most")
    parser.add_argument("--patience", type=float, default=20.0, help="seconds after which an effort is not repeated")
    parser.add_argument("--limit", type=float, default=1800.0, help="seconds after which a process is ended")
    parser.add_argument("--keep", action="store_true", help="do not measure again what the folder has measured")
    parser.add_argument("--no-threads", action="store_true", help="leave out gmsnet with several threads")
    parser.add_argument("--list", action="store_true", help="list the tools and end")
    parser.add_argument("--folder", type=Path, default=Path("build/peers"), help="for meshes, results, tables, plots")
    parser.add_argument("--docs", type=Path, help="a page that gets the tables between its markers")
    options = parser.parse_args()
    chosen = [peer for peer in (*PEERS, *OWN) if wanted(peer, options.peers)]
    if options.list:
        show(chosen)
        return
    options.folder.mkdir(parents=True, exist_ok=True)
    path = options.folder / "results.json"
    document = json.loads(path.read_text(encoding="utf-8")) if options.keep and path.exists() else {"meshes": {}}
    document |= {"machine": describe(), "date": datetime.date.today().isoformat(), "absent": ABSENT}
    print(document["machine"], flush=True)
    for name in options.meshes:
        for nodes in options.nodes:
            compare(document, name, int(nodes), chosen, options, path)
    write(document, options.folder, options.docs)


def wanted(peer: Peer, names: list[str] | None) -> bool:
    """All tools are, or those that a part of a name fits; ours always are."""
    return not names or peer in OWN or any(part.lower() in peer.name.lower() for part in names)


def show(chosen: list[Peer]) -> None:
    for peer in chosen:
        print(f"{peer.name:24} {peer.kind:26} {', '.join(peer.packages):24} {peer.licence:16} {dict(peer.options)}")
    for name, reason in ABSENT.items():
        print(f"{name:24} not to be had: {reason}")


def compare(
    document: dict[str, Any], name: str, nodes: int, chosen: list[Peer], options: argparse.Namespace, path: Path
) -> None:
    """Measures the tools on one mesh; after each the results are saved."""
    file, small = (stored(options.folder / "meshes", name, count).resolve() for count in (nodes, SMALL))
    plane = Plane.load(file)
    mesh = document["meshes"].setdefault(f"{NAMES[name]}/{nodes}", {"tools": {}, "threads": {}})
    mesh |= {"nodes": len(plane.points), "cells": len(plane.cells), "input": figures(plane.points, plane.cells)}
    print(f"\n{NAMES[name]}, {mesh['nodes']:,} nodes", flush=True)
    for peer in chosen:
        if mesh["tools"].get(peer.name, {}).get("status") != "measured":
            mesh["tools"][peer.name] = run_peer(peer, file, small, nodes, vars(options))
            save(document, path)
        tell(peer, mesh["tools"][peer.name])
    counts = [2**k for k in range(os.cpu_count().bit_length())]
    for peer in THREADED:
        if options.no_threads or len(counts) < 2 or mesh["threads"].get(peer.name, {}).get("status") == "measured":
            continue
        job = {"peer": peer.name, "mesh": str(file), "threads": counts, "repeats": options.repeats}
        mesh["threads"][peer.name] = in_a_process("peers.threads", job, {}, options.limit, options.folder)
        save(document, path)


def save(document: dict[str, Any], path: Path) -> None:
    unfinished = path.with_suffix(".part")
    unfinished.write_text(json.dumps(document, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    unfinished.replace(path)


def tell(peer: Peer, record: dict[str, Any]) -> None:
    if record["status"] != "measured":
        print(f"  {peer.name:24} {record['status']}: {record['reason']}", flush=True)
        return
    last = record["levels"][-1]
    end, did = last["figures"], last["behaviour"]
    text = "its points cannot be used" if end is None else (
        f"mean {end['mean']:.4f}  min {end['min']:7.4f}  q̂ {end['qhat']:7.4f}  inverted {end['inverted']:3}  "
        f"boundary {did['boundary']}"
    )  # fmt: skip
    print(f"  {peer.name:24} {last['seconds']:9.4f} s  {last['units']:9.1f} L  {text}", flush=True)


def write(document: dict[str, Any], folder: Path, page: Path | None) -> None:
    """Tables and pictures into the folder; into a page of the documentation the tables, and beside it what it shows."""
    text = markdown(document)
    (folder / "report.md").write_text(text, encoding="utf-8")
    pictures = draw(document, folder)
    print("\n".join(map(str, [folder / "results.json", folder / "report.md", *pictures])))
    if page:
        whole = between_markers(page.read_text(encoding="utf-8"), text)
        page.write_text(whole, encoding="utf-8")
        for picture in pictures:
            if (shown := f"peers-{picture.name}") in whole:
                shutil.copyfile(picture, page.with_name(shown))


def between_markers(page: str, text: str) -> str:
    """The page with the text in the place of what stood between the markers. Raises ValueError if it has none."""
    first, last = page.index(BEGIN) + len(BEGIN), page.index(END)
    return f"{page[:first]}\n\n{text}\n{page[last:]}"

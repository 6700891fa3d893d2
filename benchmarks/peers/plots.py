"""Pictures of the comparison; each is left out where nothing is there to show."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from peers.peer import AVERAGING, OURS, QUALITY, Peer
from peers.results import MEAN, MIN, final, goal, level_to, pair, usable
from peers.table import DEFAULT, OWN, PEERS

Document = Mapping[str, Any]
GREEN, GREY = "#1a7f37", "#57606a"
COOL = ("#08519c", "#3182bd", "#6baed6", "#9e9ac8", "#756bb1", "#54278f", "#17a2b8")
WARM = ("#a50f15", "#de2d26", "#fb6a4a", "#e6550d", "#fd8d3c", "#d4a017", "#8c510a", "#bf812d", "#c51b8a", "#7a0177")
OWN_COLOURS = (GREEN, "#74c476", "#41ab5d", "#000000", "#7fbc41")
MARKERS = "osD^vP*X<>"
WIDTH, DPI = 11.0, 150
NEAR, LOWEST = 0.4, -0.1  # of the way from the input to the best mean is shown; least 1/q that is
FIGURE_WORDS = {MEAN: "mean 1/q", MIN: "least 1/q"}


def draw(document: Document, folder: Path) -> list[Path]:
    """All pictures of a document, as PNG files of the folder."""
    import matplotlib

    matplotlib.use("Agg")
    made = [quality_over_time(name, mesh, folder) for name, mesh in document["meshes"].items()]
    made += [ahead(document, folder), cost_over_size(document, folder), over_threads(document, folder)]
    return [path for path in made if path is not None]


def style(peer: Peer) -> dict[str, Any]:
    """How a tool is drawn, in all pictures alike."""
    rows = OWN if peer.kind == OURS else [each for each in PEERS if each.kind == peer.kind]
    colours = {OURS: OWN_COLOURS, AVERAGING: COOL, QUALITY: WARM}[peer.kind]
    place = rows.index(peer)
    strong = peer.name == DEFAULT
    return {
        "color": colours[place % len(colours)], "marker": MARKERS[place % len(MARKERS)],
        "linewidth": 2.6 if strong else 1.2, "markersize": 6 if strong else 4.5, "zorder": 5 if strong else 3,
        "linestyle": "--" if peer.kind == AVERAGING else "-",
    }  # fmt: skip


def save(figure: Any, path: Path) -> Path:
    figure.savefig(path, dpi=DPI, bbox_inches="tight")
    return path


def legend(figure: Any, panels: Iterable[Any]) -> None:
    """One column to the right of the picture, a class after the other."""
    lines = {line.get_label(): line for axes in panels for line in axes.get_lines()}
    from matplotlib.lines import Line2D

    handles, labels, titles = [], [], []
    for title, kind in (("gmsnet.smooth", OURS), ("Driven by quality", QUALITY), ("Averaging, no check", AVERAGING)):
        named = [peer.name for peer in (*OWN, *PEERS) if peer.kind == kind and peer.name in lines]
        if named:
            titles.append(len(labels))
            handles += [Line2D([], [], linestyle=""), *(lines[name] for name in named)]
            labels += [title, *(name.removeprefix("gmsnet ") for name in named)]
    beside = {"loc": "center left", "bbox_to_anchor": (1.0, 0.5)}
    texts = figure.legend(handles, labels, fontsize=8, frameon=False, **beside).get_texts()
    for place in titles:
        texts[place].set_fontweight("bold")


def quality_over_time(name: str, mesh: Mapping[str, Any], folder: Path) -> Path | None:
    """Mean and least 1/q over seconds: a line for each tool, through its efforts."""
    import matplotlib.pyplot as plt

    found = [(peer, mesh["tools"][peer.name]) for peer in (*PEERS, *OWN) if usable(mesh["tools"].get(peer.name))]
    if not found:
        return None
    figure, panels = plt.subplots(1, 2, figsize=(WIDTH, 4.6), layout="constrained")
    for axes, key in zip(panels, (MEAN, MIN), strict=True):
        for peer, record in found:
            levels = [level for level in record["levels"] if level["figures"] is not None]
            values = [level["figures"][key] for level in levels]
            axes.plot([level["seconds"] for level in levels], values, label=peer.name, **style(peer))
        axes.annotate(f"input: {mesh['input'][key]:.3g}", (0.98, 0.03), xycoords="axes fraction", ha="right",
                      fontsize=8, color=GREY)  # fmt: skip
        axes.set_xscale("log")
        axes.set_xlabel("seconds of one processor, set-up included")
        axes.set_ylabel(FIGURE_WORDS[key])
        axes.grid(alpha=0.25)
    best = max(final(record)[MEAN] for _, record in found)
    panels[0].set_ylim(bottom=best - NEAR * (best - mesh["input"][MEAN]))
    panels[1].set_ylim(bottom=max(LOWEST, panels[1].get_ylim()[0]))
    figure.suptitle(f"Quality over time: {name.split('/')[0]}, {mesh['nodes']:,} nodes", fontsize=11)
    legend(figure, panels)
    path = save(figure, folder / f"quality-{name.replace(' ', '-').replace('/', '-')}.png")
    plt.close(figure)
    return path


def largest(document: Document) -> list[tuple[str, Mapping[str, Any]]]:
    """Of each kind of mesh the largest on which the tools driven by quality were measured."""
    best: dict[str, tuple[str, Mapping[str, Any]]] = {}
    for name, mesh in document["meshes"].items():
        kind = name.split("/")[0]
        slow = [peer for peer in PEERS if peer.kind == QUALITY and usable(mesh["tools"].get(peer.name))]
        larger = kind not in best or mesh["nodes"] > best[kind][1]["nodes"]
        if slow and larger and usable(mesh["tools"].get(DEFAULT)):
            best[kind] = (name, mesh)
    return list(best.values())


def ahead(document: Document, folder: Path) -> Path | None:
    """For each tool driven by quality: its seconds to 99 % of its mean 1/q, gmsnet's to the same, and the ratio."""
    import matplotlib.pyplot as plt

    chosen = largest(document)
    if not chosen:
        return None
    rows = [peer for peer in PEERS if any(usable(mesh["tools"].get(peer.name)) for _, mesh in chosen)]
    slowest = {peer.name: max(longest(mesh, peer) for _, mesh in chosen) for peer in rows}
    rows.sort(key=lambda peer: (peer.kind == QUALITY, slowest[peer.name]))
    averaging = sum(peer.kind == AVERAGING for peer in rows)
    heights = [place + (peer.kind == QUALITY) for place, peer in enumerate(rows)]  # a row for the name of each class
    figure, panels = plt.subplots(1, len(chosen), figsize=(WIDTH, 1.6 + 0.3 * len(rows)), sharey=True, squeeze=False,
                                  layout="constrained")  # fmt: skip
    for axes, (name, mesh) in zip(panels[0], chosen, strict=True):
        for height, peer in zip(heights, rows, strict=True):
            record = mesh["tools"].get(peer.name)
            if usable(record):
                dumbbell(axes, height, record, mesh)
        axes.set_xscale("log")
        low, high = axes.get_xlim()
        axes.set_xlim(low, high * 3.0)  # room for the ratios
        axes.set_title(f"{name.split('/')[0]}, {mesh['nodes']:,} nodes", fontsize=10)
        axes.set_xlabel("seconds of one processor, set-up included")
        axes.grid(axis="x", alpha=0.25)
        axes.set_ylim(-0.6, len(rows) + 1.6)
        for height, text in ((averaging, "averaging, without a check"), (len(rows) + 1, "driven by quality")):
            axes.text(0.02, height, text, transform=axes.get_yaxis_transform(), va="center", fontsize=9, color=GREY,
                      style="italic")  # fmt: skip
            axes.axhline(height + 0.6, color=GREY, linewidth=0.8)
    panels[0][0].set_yticks(heights, [peer.name for peer in rows], fontsize=9)
    marks = [plt.Line2D([], [], marker="o", linestyle="", color=colour) for colour in (GREEN, WARM[1])]
    figure.legend(marks, ["gmsnet (auto) to the same mean 1/q", "the tool, to 99 % of its own final mean 1/q"], ncols=2,
                  loc="outside upper center", fontsize=9, frameon=False)  # fmt: skip
    path = save(figure, folder / "ahead.png")
    plt.close(figure)
    return path


def longest(mesh: Mapping[str, Any], peer: Peer) -> float:
    """Seconds of a tool to 99 % of its mean; 0 where it was not measured or betters nothing."""
    record = mesh["tools"].get(peer.name)
    return (pair(record, record, mesh["input"])[MEAN].get("theirs") or 0.0) if usable(record) else 0.0


def dumbbell(axes: Any, height: float, record: Mapping[str, Any], mesh: Mapping[str, Any]) -> None:
    """The two times, joined, and how many times one fits into the other."""
    one = pair(record, mesh["tools"][DEFAULT], mesh["input"])[MEAN]
    if one.get("theirs") is None:
        return
    if one["ours"] is not None:
        axes.plot([one["ours"], one["theirs"]], [height, height], color="#d0d7de", linewidth=3, zorder=1)
        axes.plot(one["ours"], height, "o", color=GREEN, zorder=3)
        text = f"×{one['times']:.0f}" if one["times"] >= 9.95 else f"×{one['times']:.1f}"
        axes.annotate(text, (max(one["ours"], one["theirs"]), height), xytext=(7, 0), textcoords="offset points",
                      va="center", fontsize=8)  # fmt: skip
    axes.plot(one["theirs"], height, "o", color=WARM[1], zorder=2)


def cost_over_size(document: Document, folder: Path) -> Path | None:
    """Nanoseconds per node, from arrays to arrays, to 99 % of a tool's own final mean, over the number of nodes."""
    import matplotlib.pyplot as plt

    kinds: dict[str, list[Mapping[str, Any]]] = {}
    for name, mesh in document["meshes"].items():
        kinds.setdefault(name.split("/")[0], []).append(mesh)
    if not any(len(meshes) > 1 for meshes in kinds.values()):
        return None
    figure, panels = plt.subplots(1, len(kinds), figsize=(WIDTH, 4.8), sharey=True, squeeze=False, layout="constrained")
    for axes, (kind, meshes) in zip(panels[0], kinds.items(), strict=True):
        for peer in (*PEERS, *OWN):
            found = [(mesh["nodes"], own_cost(mesh["tools"].get(peer.name), mesh)) for mesh in meshes]
            found = sorted((nodes, cost) for nodes, cost in found if cost is not None)
            if found:
                axes.plot(*zip(*found, strict=True), label=peer.name, **style(peer))
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xlabel("nodes")
        axes.set_title(kind, fontsize=10)
        axes.grid(alpha=0.25)
    panels[0][0].set_ylabel("ns per node to 99 % of its own final mean 1/q")
    legend(figure, panels[0])
    path = save(figure, folder / "size.png")
    plt.close(figure)
    return path


def own_cost(record: Mapping[str, Any] | None, mesh: Mapping[str, Any]) -> float | None:
    """Nanoseconds per node to 99 % of the own mean; None where there is nothing to tell."""
    if record is None or not usable(record):
        return None
    wanted = goal(record, MEAN, mesh["input"])
    enough = None if wanted is None else level_to(record, MEAN, wanted)
    return None if enough is None else 1e9 * enough["seconds"] / mesh["nodes"]


def over_threads(document: Document, folder: Path) -> Path | None:
    """How many times as fast gmsnet is with several threads, sweeps alone and the whole call."""
    import matplotlib.pyplot as plt

    meshes = [mesh for name, mesh in document["meshes"].items() if name.startswith("random")]
    found = [
        (place, mesh["nodes"], number, method, of_method)
        for place, mesh in enumerate(meshes)
        for number, (method, of_method) in enumerate(mesh.get("threads", {}).items())
        if of_method["status"] == "measured"
    ]
    if not found:
        return None
    figure, panels = plt.subplots(1, 2, figsize=(WIDTH, 4.0), sharey=True, layout="constrained")
    most = max(max(of_method["threads"]) for *_, of_method in found)
    for axes, key, words in zip(panels, ("smoothing", "whole"), ("sweeps alone", "whole call"), strict=True):
        for place, nodes, number, method, of_method in found:
            times = [of_method[key][0] / seconds for seconds in of_method[key]]
            label = f"{method.removeprefix('gmsnet ')}, {nodes:,} nodes"
            colour, line = WARM[2 * place % len(WARM)], ("-", "--", ":")[number % 3]
            axes.plot(of_method["threads"], times, linestyle=line, marker=MARKERS[place], color=colour, label=label)
        axes.set_title(words, fontsize=10)
        axes.set_xlabel("threads")
        axes.grid(alpha=0.25)
    for axes in panels:
        axes.plot([1, most], [1, most], color=GREY, linewidth=0.8, zorder=1)
        axes.set_xticks([2**k for k in range(math.floor(math.log2(most)) + 1)])
    panels[0].set_ylabel("times as fast as with one thread")
    lines = panels[0].get_legend_handles_labels()
    figure.legend(*lines, loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=8, frameon=False)
    path = save(figure, folder / "threads.png")
    plt.close(figure)
    return path

"""The comparison as Markdown: what each tool is, what it does to each mesh, and where gmsnet stands."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from peers.checks import HELD, ROUNDED
from peers.peer import AVERAGING, OURS, QUALITY, Peer
from peers.results import MEAN, MIN, QHAT, better, final, pair, usable
from peers.table import ABSENT, DEFAULT, OWN, PEERS

PLAIN = "gmsnet laplacian plain"
TIMES_WANTED = {AVERAGING: 1.0, QUALITY: 10.0}
NONE = "–"
Document = Mapping[str, Any]


def markdown(document: Document) -> str:
    """All tables."""
    parts = [machine(document), tools(document)]
    for name, mesh in document["meshes"].items():
        parts.append(f"### {title(name, mesh)}\n\n" + before(mesh))
        parts += [table(mesh, kind) for kind in (QUALITY, AVERAGING)]
    return "\n\n".join([*parts, *filter(None, [threads(document)]), shortfalls(document)]) + "\n"


def title(name: str, mesh: Mapping[str, Any]) -> str:
    return f"{name.split('/')[0].capitalize()}, {mesh['nodes']:,} nodes"


def before(mesh: Mapping[str, Any]) -> str:
    figures = mesh["input"]
    unit = mesh["tools"].get(DEFAULT, {}).get("L")
    text = f"The input: mean 1/q {figures['mean']:.3f}, least {figures['min']:.4f}, q̂ {figures['qhat']:.3f}."
    return text + (f" L: {1e9 * unit / mesh['nodes']:.1f} ns per node." if unit else "")


def machine(document: Document) -> str:
    return "Measured on: " + "; ".join(document["machine"].splitlines()) + f"; {document['date']}."


def tools(document: Document) -> str:
    """What was compared, with versions, options and what each does to the mesh besides."""
    head = "| tool | package | licence | options | boundary nodes | its triangles | moves |\n|" + 7 * "---|"
    rows = [tool_row(peer, list(records(document, peer.name))) for peer in (*PEERS, *OWN)]
    rows += [f"| {name} | {NONE} | {NONE} | not measured: {reason} | | | |" for name, reason in ABSENT.items()]
    return "\n".join([head, *rows])


def records(document: Document, name: str) -> Iterable[Mapping[str, Any]]:
    return (mesh["tools"][name] for mesh in document["meshes"].values() if name in mesh["tools"])


def tool_row(peer: Peer, found: list[Mapping[str, Any]]) -> str:
    versions = next((each["versions"] for each in found if "versions" in each), {})
    packages = ", ".join(f"{name} {number}" for name, number in versions.items())
    options = ", ".join(f"{key}={value}" for key, value in peer.options.items())
    options = "; ".join(filter(None, (options, peer.note, f"effort: {peer.counts}")))
    did = [each["levels"][-1]["behaviour"] for each in found if each["status"] == "measured"]
    if not did:
        reason = next((f"{each['status']}: {each['reason']}" for each in found), "not asked for")
        return f"| {peer.name} | {packages} | {peer.licence} | not measured: {reason} | | | |"
    return (
        f"| {peer.name} | {packages} | {peer.licence} | {options} | {boundary_words(did)} | {cells_words(did)} | "
        f"{100 * min(each.get('moved', 0.0) for each in did):.1f} % |"
    )


def boundary_words(did: list[Mapping[str, Any]]) -> str:
    """What the boundary nodes do on the mesh on which they do most."""
    worst = max(did, key=lambda each: each.get("boundary_shift", float("inf")))
    if not worst["points_kept"]:
        return "**lost**"
    if worst["boundary"] == HELD:
        return HELD
    word = ROUNDED if worst["boundary"] == ROUNDED else f"**{worst['boundary']}**"
    return f"{word}, {worst['boundary_shift']:.0e}"


def cells_words(did: list[Mapping[str, Any]]) -> str:
    kept = {each["cells_kept"] for each in did}
    return "**changed**" if False in kept else "kept" if True in kept else "has none"


def table(mesh: Mapping[str, Any], kind: str) -> str:
    """The tools of a class beside ours: final states, and the way to what the tool reaches."""
    found, given = mesh["tools"], mesh["input"]
    ours = [OWN[0]] + [peer for peer in OWN[1:] if kind == QUALITY or "laplacian" in peer.name]
    others = [PLAIN] if kind == AVERAGING else []
    head = ["tool", "mean 1/q", "least 1/q", "q̂", "inverted", "set-up", "smoothing", "peak memory, B per node"]
    for what in ("99 % of its mean", "99 % of its least", "its q̂"):
        head += [f"to {what}: it", "auto", "times as fast"]
    head += ["to 99 % of its mean: laplacian plain", "times as fast"] if others else []
    lines = ["| " + " | ".join(head) + " |", "|" + len(head) * "---|"]
    for peer in [peer for peer in PEERS if peer.kind == kind]:
        record = found.get(peer.name)
        if record is not None and usable(record):
            lines.append(line([*state(peer, record, mesh["nodes"]), *race(record, found, given, others)]))
        elif record is not None and record["status"] not in ("not installed",):
            lines.append(line([peer.name, f"{record['status']}: {record.get('reason', 'its points cannot be used')}"]))
    lines += [line(state(peer, found[peer.name], mesh["nodes"])) for peer in ours if usable(found.get(peer.name))]
    return f"*{kind.capitalize()}*\n\n" + "\n".join(lines)


def line(cells: list[str]) -> str:
    return "| " + " | ".join(cells) + " |"


def state(peer: Peer, record: Mapping[str, Any], nodes: int) -> list[str]:
    """The final state, and what it took. Of ours the set-up is all that is not sweeps."""
    last, figures = record["levels"][-1], final(record) or {}
    alone = record.get("smoothing_alone", last["smoothing"])
    memory = (record["memory"]["peak"] - record["memory"]["before"]) / nodes
    name = f"**{peer.name}**" if peer.kind == OURS else peer.name
    return [
        name, f"{figures['mean']:.4f}", f"{figures['min']:.4f}", f"{figures['qhat']:.4f}", f"{figures['inverted']:.0f}",
        seconds(last["seconds"] - alone), seconds(alone), f"{memory:,.0f}",
    ]  # fmt: skip


def race(
    record: Mapping[str, Any], found: Mapping[str, Any], given: Mapping[str, float], others: list[str]
) -> list[str]:
    """Cells for the way to each figure."""
    cells = []
    ours = found.get(DEFAULT)
    if not usable(ours):
        return 9 * [NONE]
    against = pair(record, ours, given)
    for key in (MEAN, MIN, QHAT):
        one = against[key]
        if one["goal"] is None:
            cells += ["not bettered", NONE, NONE]
        elif one.get("in_input"):
            cells += ["in the input", NONE, NONE]
        else:
            cells += [seconds(one["theirs"]), seconds(one["ours"]), both_times(one)]
    for name in others:
        one = pair(record, found[name], given)[MEAN] if usable(found.get(name)) else {"goal": None}
        cells += [seconds(one.get("ours")), both_times(one)]
    return cells


def seconds(value: float | None) -> str:
    """Three figures, in a unit that suits."""
    if value is None:
        return "never"
    scale, unit = (1.0, "s") if value >= 1.0 else (1e3, "ms")
    return f"{value * scale:,.{0 if value * scale >= 100 else 1 if value * scale >= 10 else 2}f} {unit}"


def times(value: float | None) -> str:
    return NONE if value is None else f"{value:,.{0 if value >= 100 else 1 if value >= 10 else 2}f}"


def both_times(one: Mapping[str, Any]) -> str:
    """To the same figure; and, in brackets, against all that the tool did."""
    return NONE if one.get("times") is None else f"{times(one['times'])} ({times(one['times_whole'])})"


def shortfalls(document: Document) -> str:
    """Where gmsnet is not as far ahead as it is meant to be."""
    lines = []
    for name, mesh in document["meshes"].items():
        for peer in PEERS:
            record, ours = mesh["tools"].get(peer.name), mesh["tools"].get(DEFAULT)
            if not (usable(record) and usable(ours)):
                continue
            lines += [f"- {title(name, mesh)}, {peer.name}: {text}" for text in short(peer, record, mesh)]
    aim = f"at least as fast as averaging tools, {TIMES_WANTED[QUALITY]:.0f} times as fast as those driven by quality"
    text = f"Aimed at is: {aim}, to 99 % of their mean and least 1/q; and a better least 1/q and q̂ in the end."
    return f"### Where the aim is missed\n\n{text}\n\n" + ("\n".join(lines) if lines else "Nowhere.")


def short(peer: Peer, record: Mapping[str, Any], mesh: Mapping[str, Any]) -> list[str]:
    """What is missed against one tool on one mesh, a sentence each."""
    found, wanted = mesh["tools"], TIMES_WANTED[peer.kind]
    names = [DEFAULT, PLAIN] if peer.kind == AVERAGING else [DEFAULT]
    ours = [found[name] for name in names if usable(found.get(name))]
    texts = []
    for key, words in ((MEAN, "99 % of its mean"), (MIN, "99 % of its minimum 1/q")):
        against = [pair(record, each, mesh["input"])[key] for each in ours]
        if against[0]["goal"] is None or against[0]["in_input"] or (key == MIN and peer.kind == AVERAGING):
            continue
        reached = [one for one in against if one["times"] is not None]
        most = max(reached, key=lambda one: one["times"], default=None)
        if most is None:
            texts.append(f"{words} is not reached")
        elif most["times"] < wanted:
            ratios = (
                f"{times(most['times'])} times as fast to {words} ({times(most['times_whole'])} with all that it did)"
            )
            texts.append(f"{ratios}, {wanted:.0f} wanted")
    ahead = better(found[DEFAULT], record)
    texts += [f"its {words} is better" for key, words in ((MIN, "minimum 1/q"), (QHAT, "q̂")) if not ahead[key]]
    return texts


def threads(document: Document) -> str | None:
    """gmsnet with several threads."""
    rows = []
    for name, mesh in document["meshes"].items():
        for method, found in mesh.get("threads", {}).items():
            if found["status"] != "measured":
                continue
            for count, whole, alone in zip(found["threads"], found["whole"], found["smoothing"], strict=True):
                rows.append(line([
                    title(name, mesh), method, str(count), seconds(whole), times(found["whole"][0] / whole),
                    seconds(alone), times(found["smoothing"][0] / alone), "yes" if found["same_bits"] else "**no**",
                ]))  # fmt: skip
    if not rows:
        return None
    head = "| mesh | method | threads | whole call | times one thread | smoothing | times one thread | same bits |"
    return "\n".join(["### Threads (seconds of the clock)", "", head, "|" + 8 * "---|", *rows])

"""The parts of a page that are read: the verdict, figures, the worst cells, what is held, what could not be mended."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from gmsnet.measure.figures import Figure, at, figures_of
from gmsnet.measure.summary import BEST_IS_LOW
from gmsnet.measure.worst import worst_rows
from gmsnet.mesh.display import amount
from gmsnet.mesh.known_cells import counts
from gmsnet.page.contents import LISTED, Contents
from gmsnet.page.markup import grid, listed, row, section, table, text

CARDS = (("inverted",), ("shape", "min"), ("shape", "mean"), ("min_angle", "min"), ("min_dihedral", "min"))


def header(contents: Contents) -> str:
    """What was done, and whether it is what was asked for."""
    faults = "".join(f"<li>{text(fault)}</li>" for fault in contents.faults)
    return (
        f'<header><p class="kind">{"Report of a mesh" if contents.before is None else "Report of a smoothed mesh"}</p>'
        f"<h1>{text(contents.title)}</h1><p>{text(counts(contents.mesh))}</p>"
        f'<p id="verdict" class="verdict">{text(_sentence(contents.verdict))}</p>'
        + (f'<ul id="faults" class="faults">{faults}</ul>' if faults else "")
        + f"</header>{_cards(contents)}"
    )


def _sentence(words: str) -> str:
    return words[:1].upper() + words[1:] + ("" if words.endswith(".") else ".")


def figures(contents: Contents) -> str:
    """All figures in a table."""
    if not len(contents.after.cell):
        return section("figures", "Figures", "<p>There are no cells whose quality is known.</p>")
    rows = [
        row(
            f'<th scope="row">{text(figure.label)}</th>',
            figure.texts,
            {"data-path": ".".join(figure.path), "class": _change(contents, figure)},
        )
        for figure in _figures(contents)
    ]
    body = table("Figures of all cells; angles in degrees", ["", *contents.reports], "".join(rows))
    return section("figures", "Figures", body)


def worst(contents: Contents) -> str:
    """The worst cells, each with a button that shows it."""
    parts = [_worst("after", f"Worst cells {'now' if contents.before is None else 'after'}", contents.worst_after)]
    if contents.worst_before:
        parts.append(_worst("before", "Worst cells before", contents.worst_before))
    return "".join(parts)


def held(contents: Contents) -> str:
    """Why nodes are held, each reason with a box that shows them."""
    if not contents.held:
        return ""
    nodes = sum(len(ids) for ids in contents.held.values())
    rows = "".join(
        f'<li><label class="k{k % 8}"><input type="checkbox" data-reason="{k}" disabled> <span class="dot"></span> '
        f'{text(reason)} <b data-path="held" data-reason="{text(reason)}">{len(ids):,}</b></label></li>'
        for k, (reason, ids) in enumerate(contents.held.items())
    )
    share = f"{nodes:,} of {amount(len(contents.mesh.points), 'node')} stay where they are:"
    return f'<section id="held"><h3>Held nodes</h3><p>{text(share)}</p><ul class="plain">{rows}</ul></section>'


def unmended(contents: Contents) -> str:
    """The cells that could not be mended, and why."""
    if not contents.unmended:
        return ""
    rows = "".join(row(_button(cell, "after", f"{cell}"), [reason]) for cell, reason in contents.unmended[:LISTED])
    rest = len(contents.unmended) - LISTED
    more = f"<p>And {rest:,} more.</p>" if rest > 0 else ""
    return section(
        "unmended", "What could not be mended", table("Cells, by number from 0", ["cell", "why"], rows) + more
    )


def remarks(contents: Contents) -> str:
    """What else there is to know."""
    facts = "".join(f"<dt>{text(term)}</dt><dd>{text(said)}</dd>" for term, said in contents.facts)
    body = (f"<dl>{facts}</dl>" if facts else "") + listed(contents.notes)
    tables = "".join(grid(each.title, each.rows) for each in contents.grids)
    return section("notes", "What was done", body + tables)


def _figures(contents: Contents) -> list[Figure]:
    return figures_of(contents.summaries)


def _cards(contents: Contents) -> str:
    """The few figures that say most."""
    if not len(contents.after.cell):
        return ""
    known = {figure.path: figure for figure in _figures(contents)}
    chosen = [known[path] for path in CARDS if path in known]
    return f'<ul class="cards">{"".join(_card(contents, figure) for figure in chosen)}</ul>'


def _card(contents: Contents, figure: Figure) -> str:
    unit = "°" if figure.path[0] in ("min_angle", "min_dihedral") else ""
    *before, after = (f"{each}{unit}" for each in figure.texts)
    was = f'<span class="was">{text(before[0])}</span> <span aria-label="to">→</span> ' if before else ""
    change = _change(contents, figure)
    return (
        f'<li class="{change}"><span class="term">{text(figure.label)}</span> {was}<strong>{text(after)}</strong></li>'
    )


def _change(contents: Contents, figure: Figure) -> str:
    """Whether a figure became better or worse."""
    if contents.before is None:
        return "same"
    before, after = (at(summary, figure.path) for summary in contents.summaries)
    if figure.texts[0] == figure.texts[-1] or before is None or after is None:
        return "same"
    low = figure.path[0] == "inverted" or figure.path[0] in BEST_IS_LOW or figure.path[-1].startswith("below")
    return "better" if (after < before) == low else "worse"


def _worst(state: str, caption: str, cells: Sequence[Mapping[str, Any]]) -> str:
    if not cells:
        return ""
    head, *rows = worst_rows(cells)
    where = head.index("at")  # where a cell is, the picture shows; the row is then short enough to stand beside it
    columns = [k for k in range(1, len(head)) if k != where]
    made = "".join(
        row(_button(cell["cell"], state, texts[0]), [texts[k] for k in columns], {"title": f"at {texts[where]}"})
        for cell, texts in zip(cells, rows, strict=True)
    )
    return f'<div id="worst-{state}">{table(caption, [head[0], *(head[k] for k in columns)], made)}</div>'


def _button(cell: int, state: str, label: str) -> str:
    return (
        f'<th scope="row"><button type="button" class="go" data-cell="{cell}" data-state="{state}" disabled>'
        f"{text(label)}</button></th>"
    )

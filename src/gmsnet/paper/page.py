"""The page: one self-contained HTML file of what a reproduction found."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from importlib.resources import files
from typing import Any

from jinja2 import Environment, StrictUndefined

from gmsnet.paper import printed, table2
from gmsnet.paper.contenders import GMSNET

TEMPLATE = "page.html.jinja"
HEADS = {  # of the columns of Tables 2 and 3
    "min_angle_min": "min angle, min",
    "min_angle_mean": "min angle, mean",
    "max_angle_max": "max angle, max",
    "max_angle_mean": "max angle, mean",
    "inv_q_min": "1/q_V, min",
    "inv_q_mean": "1/q_V, mean",
    "shape_min": "1/q, min",
    "shape_mean": "1/q, mean",
    "qhat": "q̂",
    "inverted": "inverted",
}


def page(document: Mapping[str, Any], pictures: Mapping[str, bytes]) -> bytes:
    """The document as a page. pictures: PNG files by the names in the document; they become part of the page."""
    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True
    )
    environment.filters |= {"seconds": seconds, "signed": signed, "minutes": minutes, "short": short}
    template = environment.from_string(files(__package__).joinpath(TEMPLATE).read_text(encoding="utf-8"))
    embedded = {name: base64.b64encode(content).decode() for name, content in pictures.items()}
    text = template.render(
        document=document,
        pictures=embedded,
        heads=HEADS,
        columns=[name for name in HEADS if name != "inverted"],
        decimals={name: table2.decimals(name) for name in HEADS},
        ordered=table2.ORDERED,
        papers_ratio=printed.SPEED_RATIO,
        papers_mean_ratio=printed.MEAN_SPEED_RATIO,
        gmsnet=GMSNET,
    )
    return text.encode()


def seconds(value: float | None) -> str:
    """A duration with three digits and its unit."""
    if value is None:
        return "–"
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if value >= size:
            return f"{value / size:.3g} {unit}"
    return f"{value / 1e-9:.3g} ns"


def minutes(value: float) -> str:
    """A longer duration."""
    return f"{value / 60:.1f} min" if value >= 60 else f"{value:.0f} s"


def short(name: str) -> str:
    """A method's name without what all of them share."""
    return name.removesuffix("Smoothing").removesuffix("-")


def signed(value: float, decimals: int) -> str:
    """A difference, with a true minus."""
    text = f"{value:+.{decimals}f}"
    return "±" + text[1:] if float(text) == 0 else text.replace("-", "−")

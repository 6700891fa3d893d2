"""A figure of the reproduction: how it is drawn, and what is kept of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from gmsnet.paper.store import Result
from gmsnet.paper.units import Context, Unit
from gmsnet.plot import png_bytes

if TYPE_CHECKING:
    from gmsnet.plot import Figure

DPI = 110


@dataclass(frozen=True)
class Drawn:
    """A figure with its caption. facts: what was measured on the way, for the claims."""

    figure: Figure
    caption: str
    facts: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Picture:
    """name: of its file."""

    name: str
    title: str
    draw: Callable[[Context], Drawn]

    @property
    def unit(self) -> Unit:
        """The work of drawing it."""
        return Unit(f"figure/{self.name}", _draw, {"picture": self})

    @property
    def file(self) -> str:
        """Where the picture lies in the folder."""
        return f"figures/{self.name}.png"


def _draw(context: Context, picture: Picture) -> Result:
    drawn = picture.draw(context)
    values = {"title": picture.title, "caption": drawn.caption, "file": picture.file, "facts": dict(drawn.facts)}
    return Result(values, {picture.file: png_bytes(drawn.figure, DPI)})

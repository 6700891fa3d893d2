"""Figures without a display: made, checked for, and turned into bytes."""

from __future__ import annotations

import io
import os
from pathlib import Path
from typing import TYPE_CHECKING

from gmsnet.errors import InputError, MissingExtraError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SUFFIXES = (".png", ".svg", ".pdf")
DPI = 150


def check_target(path: str | os.PathLike[str]) -> None:
    """Raise what plotting to this path would raise for its suffix, or for want of matplotlib, before any work."""
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        shown = f"the suffix {suffix!r}" if suffix else "no suffix"
        raise InputError(f"{path}: a picture cannot have {shown}: name it .png, .svg or .pdf")
    _need_matplotlib()


def new_figure(width: float, height: float) -> Figure:
    """An empty figure, in inches, that needs no display. MissingExtraError where matplotlib is not installed."""
    _need_matplotlib()
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def file_bytes(figure: Figure, suffix: str, dpi: int = DPI) -> bytes:
    """A figure as the content of a file with this suffix."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format=suffix.lower()[1:], dpi=dpi)
    return buffer.getvalue()


def png_bytes(figure: Figure, dpi: int = DPI) -> bytes:
    """A figure as a PNG file."""
    return file_bytes(figure, ".png", dpi)


def _need_matplotlib() -> None:
    try:
        import matplotlib  # noqa: F401
    except ModuleNotFoundError as error:
        if error.name != "matplotlib":
            raise
        raise MissingExtraError(
            'pictures need matplotlib, which is not installed: install the extra "view", in the folder of the sources '
            'by pip install ".[view]"'
        ) from error

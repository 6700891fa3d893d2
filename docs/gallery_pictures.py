"""The pictures that a script of the gallery writes (*.png) are shown on its page, below the part that wrote them."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from sphinx_gallery.scrapers import figure_rst


def _get_sg_image_scraper() -> Callable[[Any, Mapping[str, Any], Mapping[str, Any]], str]:
    """What sphinx-gallery asks a module for that is named among its ``image_scrapers``."""
    return pictures


def pictures(block: Any, variables: Mapping[str, Any], conf: Mapping[str, Any]) -> str:
    """Moves the pictures beside the script to where the page looks for them; returns the lines that show them."""
    shown = []
    for picture in sorted(Path(variables["src_file"]).parent.glob("*.png")):
        shown.append(str(next(variables["image_path_iterator"])))
        shutil.move(picture, shown[-1])
    return figure_rst(shown, conf["src_dir"])

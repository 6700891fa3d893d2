"""The page as a whole: a policy that lets nothing in but its own script and style, then what there is to say."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Iterable, Iterator
from importlib.metadata import version
from importlib.resources import files

from gmsnet.measure.palette import AFTER, BEFORE, INVERTED
from gmsnet.page.arrays import packed
from gmsnet.page.contents import Contents
from gmsnet.page.histogram import histograms
from gmsnet.page.markup import json_block, section, text
from gmsnet.page.scene import scene_of
from gmsnet.page.sections import figures, header, held, remarks, unmended, worst
from gmsnet.page.viewer import viewer

SCRIPTS = ("data.js", "cells.js", "camera.js", "shaders.js", "picture.js", "overlay.js", "input.js", "view.js")
STYLE = "page.css"


def pieces(contents: Contents) -> Iterator[bytes]:
    """The page, piece by piece."""
    for piece in _pieces(contents):
        yield piece.encode("utf-8", errors="backslashreplace")  # names of files may be no Unicode


def _pieces(contents: Contents) -> Iterator[str]:
    scene = scene_of(contents)
    style, script = _style(), _script() if scene else ""
    yield _head(contents.title, style, script)
    yield header(contents)
    yield viewer(contents, scene, worst(contents) + held(contents))
    yield unmended(contents)
    yield f'<div class="two">{figures(contents)}{section("histograms", "Distribution", histograms(contents))}</div>'
    yield remarks(contents)
    yield _footer(contents)
    yield json_block("report", contents.document) + "\n"
    if scene is not None:
        known, elements = packed(scene.arrays)
        yield json_block("scene", {**scene.known, "arrays": known}) + "\n"
        yield from elements
        yield f"<script>{script}</script>\n"
    yield "</body></html>\n"


def _head(title: str, style: str, script: str) -> str:
    allowed = f"script-src {_hash(script)}; " if script else ""
    policy = f"default-src 'none'; {allowed}style-src {_hash(style)}; base-uri 'none'; form-action 'none'"
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta name="color-scheme" content="light dark"><meta name="referrer" content="no-referrer">\n'
        f'<meta name="generator" content="gmsnet {version("gmsnet")}">\n'
        f"<title>{text(title)} – gmsnet report</title>\n<style>{style}</style></head>\n<body>\n"
    )


def _footer(contents: Contents) -> str:
    body = (
        f'<pre id="command">{text(contents.command)}</pre><p>gmsnet <span id="version">{version("gmsnet")}</span></p>'
    )
    return f"<footer>{section('made', 'How this was made', body)}</footer>\n"


def _hash(content: str) -> str:
    """How a policy names an element by its content."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(content.encode()).digest()).decode()}'"


def _style() -> str:
    colours = f":root{{--before:{BEFORE};--after:{AFTER};--inverted:{INVERTED}}}\n"
    return colours + _joined([STYLE])


def _script() -> str:
    return f'(() => {{\n"use strict";\n{_joined(SCRIPTS)}}})();\n'


def _joined(names: Iterable[str]) -> str:
    folder = files(__package__)
    return "".join(folder.joinpath(name).read_text(encoding="utf-8") for name in names)

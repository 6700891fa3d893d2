"""Reads pages again, slowly and independently of the scripts in them."""

from __future__ import annotations

import base64
import json
import zlib
from html.parser import HTMLParser

import numpy as np

VOID = {"meta", "input", "br"}


class Page(HTMLParser):
    """tags: (name, attributes) in order. scripts: (attributes, text). styles: texts. texts: by id of the element."""

    def __init__(self, content: bytes) -> None:
        super().__init__(convert_charrefs=True)
        self.tags, self.scripts, self.styles, self.texts, self.open = [], [], [], {}, []
        self.feed(content.decode())
        self.close()
        assert not self.open, self.open

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag == "script":
            self.scripts.append((dict(attrs), ""))
        if tag == "style":
            self.styles.append("")
        if tag not in VOID:
            self.open.append((tag, dict(attrs).get("id")))

    def handle_startendtag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        assert self.open.pop()[0] == tag

    def handle_data(self, data):
        if self.open and self.open[-1][0] == "script":
            self.scripts[-1] = self.scripts[-1][0], self.scripts[-1][1] + data
        elif self.open and self.open[-1][0] == "style":
            self.styles[-1] += data
        for _, name in self.open:
            if name:
                self.texts[name] = self.texts.get(name, "") + data

    @property
    def running(self) -> list[str]:
        """The scripts that run."""
        return [text for attributes, text in self.scripts if "type" not in attributes]

    def block(self, name: str):
        """The values of a block of data."""
        return json.loads(next(text for attributes, text in self.scripts if attributes.get("id") == name))

    def array(self, name: str) -> np.ndarray:
        """One of the arrays of the scene, as it is kept."""
        known = self.block("scene")["arrays"][name]
        text = next(text for attributes, text in self.scripts if attributes.get("id") == f"array-{name}")
        return unpacked(text, known["type"], known["count"])


def unpacked(text: str, kind: str, count: int) -> np.ndarray:
    planes = zlib.decompress(base64.b64decode(text))
    size = int(kind[1])
    assert len(planes) == size * count
    data = bytes(planes[plane * count + i] for i in range(count) for plane in range(size))
    values = np.frombuffer(data, dtype=f"<{kind}")
    if kind != "u4":
        return values
    out, total = [], 0
    for folded in values.tolist():
        total += folded // 2 if folded % 2 == 0 else -(folded + 1) // 2
        out.append(total % 2**32)
    return np.array(out, dtype=np.uint32)

"""Runs that a page can tell of, and a browser to look at pages."""

from __future__ import annotations

import base64
import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import gmsnet
from gmsnet.generate import disturb, random_mesh, random_volume
from gmsnet.page import write_page
from gmsnet.run.account import Account
from gmsnet.run.reporting import contents_of

FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]


@pytest.fixture(scope="session")
def planar():
    """A random square of triangles before and after, as the contents of a page."""
    mesh = random_mesh(120, seed=3)
    return contents_of(Account(mesh, gmsnet.smooth(mesh)), "square.su2", "gmsnet smooth square.su2 out.su2")


@pytest.fixture(scope="session")
def volume():
    """The same in space."""
    mesh = random_volume(60, seed=3)
    return contents_of(Account(mesh, gmsnet.smooth(mesh)), "cube.mesh", "gmsnet smooth cube.mesh out.mesh")


@pytest.fixture(scope="session")
def tangled():
    """A square some cells of which stay inverted: untangling was off."""
    mesh = random_mesh(120, seed=3)
    mesh = disturb(mesh, gmsnet.quality(mesh).cells.corners[40:43].ravel(), 1.5, seed=1, keep_valid=False)
    result = gmsnet.smooth(mesh, untangle=False, max_sweeps=0)
    assert result.after.inverted
    return contents_of(Account(mesh, result), "tangled", "gmsnet smooth tangled --no-untangle")


@pytest.fixture(scope="session")
def browser() -> Iterator[object]:
    """Chromium without a window, drawing without a graphics processor."""
    found = os.environ.get("GMSNET_CHROMIUM") or shutil.which("chromium") or shutil.which("google-chrome")
    if not found:
        pytest.skip("there is no Chromium: neither on the path nor where GMSNET_CHROMIUM says")
    playwright = pytest.importorskip("playwright.sync_api", reason="pages are looked at through playwright")
    with playwright.sync_playwright() as running:
        browser = running.chromium.launch(executable_path=found, args=FLAGS)
        yield browser
        browser.close()


class Seen:
    """A page in the browser. said: what came to its console. asked: what it asked for."""

    def __init__(self, page, path: Path) -> None:
        self.page, self.said, self.asked = page, [], []
        page.on("console", lambda message: self.said.append(message.text))
        page.on("pageerror", lambda error: self.said.append(str(error)))
        page.on("request", lambda request: self.asked.append(request.url))
        page.goto(path.as_uri())
        page.wait_for_selector("html[data-picture]", state="attached")
        assert page.evaluate("document.documentElement.dataset.picture") == "ready", page.inner_text("#failure")

    def pixels(self) -> np.ndarray:
        """(height, width, 3) of the picture, from the bottom, once it is drawn anew."""
        values, width, height = self.page.evaluate(
            """async () => {
              await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
              const gl = document.getElementById("canvas").getContext("webgl2");
              const [width, height] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
              const bytes = new Uint8Array(4 * width * height);
              gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
              return [btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join("")), width, height];
            }"""
        )
        return np.frombuffer(base64.b64decode(values), dtype=np.uint8).reshape(height, width, 4)[..., :3]


@pytest.fixture
def seen(browser, tmp_path):
    """seen(contents) → its page in the browser; it is checked at the end that it said and asked for nothing."""
    opened = []

    def open_page(contents, **options) -> Seen:
        path = tmp_path / f"page {len(opened)} #1.html"
        write_page(path, contents)
        page = browser.new_page(viewport={"width": 1200, "height": 900}, **options)
        opened.append((Seen(page, path), path))
        return opened[-1][0]

    yield open_page
    for each, path in opened:
        assert each.said == []
        assert each.asked == [path.as_uri()]
        each.page.close()

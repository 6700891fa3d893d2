"""What a report costs: its size, seconds to write it, and seconds until Chromium shows its picture.

    python benchmarks/report.py                       # 2,000, 100,000 and 1,000,000 triangles, and as many tetrahedra
    python benchmarks/report.py --cells 2000 --keep . # keep the pages here
    python benchmarks/report.py --picture docs/report.png  # only the picture of docs/report.md

Chromium draws without a graphics processor (SwiftShader), which is the slowest that a reader can have. "picture" is
from opening the file to the first picture, "frame" is one more picture of the whole mesh, "work" are
seconds of the processor. It needs playwright, and
Chromium in /usr/bin/chromium or where GMSNET_CHROMIUM says.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from pathlib import Path

from machine import describe
from PIL import Image
from playwright.sync_api import sync_playwright

import gmsnet
from gmsnet.generate import disturb, part_volume, random_mesh, random_volume

CHROMIUM = os.environ.get("GMSNET_CHROMIUM", "/usr/bin/chromium")
FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]
FRAME = """async () => {
  const box = document.getElementById("edges"), gl = document.getElementById("canvas").getContext("webgl2");
  const times = [];
  for (let k = 0; k < 5; k++) {
    const began = performance.now();
    box.click();
    await new Promise(requestAnimationFrame);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
    times.push(performance.now() - began);
  }
  return times.sort((a, b) => a - b)[2] / 1000;
}"""


def measure(kind: str, cells: int, folder: Path) -> None:
    """Prints one row."""
    mesh = random_mesh(cells // 2, seed=1) if kind == "triangles" else random_volume(round(cells / 6.6), seed=1)
    result = gmsnet.smooth(mesh, max_sweeps=3)
    result.limits  # noqa: B018  # part of the page, but no part of writing it
    path, began, work = folder / f"{kind}-{cells}.html", time.perf_counter(), time.process_time()
    result.report(path)
    written, work = time.perf_counter() - began, time.process_time() - work
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        page = browser.new_page(viewport={"width": 1360, "height": 1000})
        began = time.perf_counter()
        page.goto(path.absolute().as_uri())
        page.wait_for_selector("html[data-picture]", state="attached", timeout=300_000)
        opened = time.perf_counter() - began
        assert page.evaluate("document.documentElement.dataset.picture") == "ready", page.inner_text("#failure")
        frame = page.evaluate(FRAME)
        browser.close()
    size, drawn = path.stat().st_size / 1e6, len(result.after.cell)
    print(
        f"| {drawn:,} {kind} | {size:.2f} MB | {written:.2f} s | {work:.2f} s | {opened:.1f} s | {frame:.2f} s |",
        flush=True,
    )


def picture(target: Path, folder: Path) -> None:
    """A page as it is seen: a part of tetrahedra whose nodes were thrown out of place, cut in the middle."""
    mesh = part_volume(9)
    free = gmsnet.smooth(mesh, max_sweeps=0).topology.free
    mesh = disturb(mesh, free, 0.5, seed=1)
    path = folder / "part.html"
    gmsnet.smooth(mesh).report(path)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        page = browser.new_page(viewport={"width": 1180, "height": 1050})
        page.goto(path.absolute().as_uri())
        page.wait_for_selector("html[data-picture=ready]", state="attached")
        page.select_option("#axis", "y")
        page.click("#worst-before .go >> nth=0")
        page.click("#whole")
        page.focus("#canvas")
        page.wait_for_timeout(500)
        page.screenshot(path=target)
        browser.close()
    Image.open(target).convert("RGB").quantize(96).save(target, optimize=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", type=int, nargs="+", default=[2_000, 100_000, 1_000_000])
    parser.add_argument("--kinds", nargs="+", default=["triangles", "tetrahedra"])
    parser.add_argument("--keep", type=Path, help="the folder for the pages (default: they are deleted)")
    parser.add_argument("--picture", type=Path, help="make the picture of docs/report.md instead")
    given = parser.parse_args()
    if given.picture:
        with tempfile.TemporaryDirectory() as folder:
            picture(given.picture, Path(folder))
        return
    print(describe())
    print("\n| cells | file | written in | of work | picture after | frame |\n|---|---:|---:|---:|---:|---:|")
    with tempfile.TemporaryDirectory() as folder:
        for kind in given.kinds:
            for cells in given.cells:
                measure(kind, cells, given.keep or Path(folder))


if __name__ == "__main__":
    main()

"""Keeps a run of ``gmsnet reproduce all`` beside docs/reproduction.md: its tables, and its pictures in fewer colours.

python docs/keep_run.py OUT
"""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path

from PIL import Image

KEPT = Path(__file__).parent / "reproduction"
LARGEST = (1400, 1600)  # pixels
COLOURS = 96


def main(out: Path) -> None:
    KEPT.mkdir(exist_ok=True)
    for table in out.glob("*.csv"):
        shutil.copyfile(table, KEPT / table.name)
    document = json.loads((out / "reproduction.json").read_text(encoding="utf-8"))
    (KEPT / "reproduction.json").write_text(
        json.dumps(document, separators=(",", ":"), ensure_ascii=False), encoding="utf-8"
    )
    for picture in (out / "figures").glob("*.png"):
        image = Image.open(picture).convert("RGB")
        image.thumbnail(LARGEST)
        image.quantize(COLOURS, dither=Image.Dither.NONE).save(KEPT / picture.name, optimize=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))

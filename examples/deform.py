"""Makes docs/deform.png: an airfoil with layers pitched by 30°, a hole moved by two radii, a strip bent by 90°."""

from __future__ import annotations

import math
from io import BytesIO
from pathlib import Path

import numpy as np
from PIL import Image

import gmsnet
from gmsnet.generate import layered_mesh, moved_hole_mesh, structured_mesh
from gmsnet.plot import View, draw, new_figure, png_bytes

airfoil = layered_mesh(12, 50.0, 90, cells="mixed")
plate = moved_hole_mesh(0.04, shift=0.0)
strip = structured_mesh(80, 10)
strip = strip.with_points(strip.points * ([8.0, 1.0, 1.0][: strip.points.shape[1]]))
sides = np.unique(np.concatenate([strip.markers[side] for side in ("bottom", "right", "top", "left")]))
x, y = strip.points[sides, :2].T
way = 16.0 / math.pi - (y - 0.5)
bent = np.column_stack([way * np.sin(x * math.pi / 16.0), 16.0 / math.pi - way * np.cos(x * math.pi / 16.0)])

results = (
    (airfoil, gmsnet.deform(airfoil, rotate=("airfoil", -30.0, (0.25, 0.0))), [[-0.2, -0.6], [1.3, 0.5]]),
    (plate, gmsnet.deform(plate, (0.21, 0.21), "hole"), None),
    (strip, gmsnet.deform(strip, places=bent, nodes=sides), None),
)
figure = new_figure(13.0, 9.0)
for column, (before, result, box) in enumerate(results):
    for row, mesh in enumerate((before, result.mesh)):
        view = View.of(mesh)
        axes = figure.add_subplot(2, 3, 3 * row + column + 1)
        draw(axes, view, None if box is None else np.array(box))
        axes.set_title(view.summary, fontsize=10)
target = Path(__file__).parents[1] / "docs" / "deform.png"
with Image.open(BytesIO(png_bytes(figure, 70))) as picture:  # few colours: a third of the bytes
    picture.convert("RGB").quantize(48).save(target, optimize=True)
for _, result, _ in results:
    print(result.verdict, f"{result.after.inverted} inverted")

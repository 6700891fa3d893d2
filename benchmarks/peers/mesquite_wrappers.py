"""Mesquite: its wrappers for shapes, in a program of their own (mesquite_driver.cpp, which tells how it is built).

What writing, reading and starting take does not count: the program tells the seconds of its set-up, from arrays, and of
its smoothing. ShapeImprover is conjugate gradients, ShapeImprovementWrapper feasible Newton, both on the whole mesh.
One call stops early on bad meshes, and another one goes on from there: the effort is calls.
"""

from __future__ import annotations

import os
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from peers.peer import Plane

PROGRAM = "MESQUITE_DRIVER"  # the environment variable that names it


class Wrapper:
    def __init__(self, plane: Plane, wrapper: str) -> None:
        self.plane, self.wrapper = plane, wrapper

    def smooth(self, effort: int) -> None:
        with TemporaryDirectory() as folder:
            given, found = Path(folder, "given"), Path(folder, "found")
            self.write(given)
            subprocess.run([os.environ[PROGRAM], self.wrapper, str(effort), given, found], check=True)
            with found.open() as file:
                self.seconds = [*map(float, file.readline().split()), 0.0]
                self.end = np.loadtxt(file)

    def write(self, path: Path) -> None:
        plane = self.plane
        with path.open("w") as file:
            file.write(f"{len(plane.points)} {len(plane.cells)} {len(plane.quads)}\n")
            np.savetxt(file, np.column_stack([plane.points, plane.held]), "%.17g %.17g %d")
            for cells in (plane.cells, plane.quads):
                np.savetxt(file, cells, "%d")

    def points(self) -> np.ndarray:
        return self.end

    def cells(self) -> None:
        return None

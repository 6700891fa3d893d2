"""What is said of a mesh's quality: figures of all cells, the worst of them, and those below a threshold."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from gmsnet.measure.report import QualityReport
from gmsnet.measure.worst import NAMED, named_numbers, worst_cells
from gmsnet.mesh.display import text_table
from gmsnet.mesh.known_cells import counts, unmeasured
from gmsnet.mesh.mesh import Mesh


@dataclass(frozen=True)
class Overview:
    """Of the measured cells of a mesh, in plain values.

    nodes: how many. planar, volumes: whether the mesh is in a plane, or of volumes; else it is a surface. told: how
    many nodes and cells there are, in words. cells: how many are measured; figures: as of ``QualityReport.summary``.
    worst: as of ``worst_cells``. others: those that are not measured, and remarks: what else is to be known, in words.
    below: how many cells are below a threshold, with the numbers of the worst of these. gathered: why ranks have not
    shared the work, "" where they have, or there was one process.
    """

    nodes: int
    planar: bool
    volumes: bool
    told: str
    cells: int
    figures: dict[str, Any] = field(repr=False)
    worst: list[dict[str, Any]] = field(repr=False)
    others: str = ""
    remarks: tuple[str, ...] = ()
    below: tuple[int, list[int]] = (0, [])
    gathered: str = ""

    @classmethod
    def of(cls, mesh: Mesh, report: QualityReport, threshold: float | None = None, gathered: str = "") -> Overview:
        """Of a mesh and its measures. threshold: of 1/q or η."""
        few = 0 if threshold is None else int((report.shape < threshold).sum())
        return cls(
            nodes=len(mesh.points),
            planar=mesh.plane is not None,
            volumes=mesh.has_volumes,
            told=counts(mesh),
            cells=len(report.cell),
            figures=report.summary(),
            worst=worst_cells(mesh, report),
            others=unmeasured(mesh),
            remarks=tuple(report.remarks),
            below=(few, report.cell[report.worst(few)[:NAMED]].tolist() if few else []),
            gathered=gathered,
        )

    def summary(self) -> dict[str, Any]:
        """``figures``."""
        return self.figures

    def below_in_words(self) -> str:
        """The cells below the threshold."""
        count, numbers = self.below
        return named_numbers(numbers, count, "below it")

    def __repr__(self) -> str:
        """The few figures that say the most."""
        rows = [("cells", f"{self.cells:,}"), ("inverted", f"{self.figures.get('inverted', 0):,}")]
        if "shape" in self.figures:
            symbol = "η" if self.volumes else "1/q"
            rows += [(f"{symbol}, {name}", f"{self.figures['shape'][key]:.4f}") for name, key in LEAST_AND_MEAN]
        return text_table([("Overview", ""), *rows])


LEAST_AND_MEAN = (("least", "min"), ("mean", "mean"))

"""The paper's figures, and one beyond them: each drawn by a function of its own, as a unit of work."""

from __future__ import annotations

from gmsnet.paper.figures import cases, convergence, curves, dataset, raw_moves, surfaces
from gmsnet.paper.figures.picture import Picture
from gmsnet.paper.units import Unit

PICTURES = (
    Picture("dataset", "Meshes of the training set and their labels", dataset.draw),
    Picture("cases", "The four cases before and after GMSNet", cases.draw_cases),
    Picture("networks", "NN-Smoothing and GMSNet", cases.draw_networks),
    Picture("distributions", "Distributions of quality before and after GMSNet", cases.draw_distributions),
    Picture("surfaces", "The four losses over the position of the free node", surfaces.draw),
    Picture("curves", "Training and validation with the four losses", curves.draw),
    Picture("raw-moves", "What truncation prevents", raw_moves.draw),
    Picture("convergence", "Convergence by sweeps and by time", convergence.draw),
)


def units() -> list[Unit]:
    """One for each picture."""
    return [each.unit for each in PICTURES]


__all__ = ["PICTURES", "Picture", "units"]

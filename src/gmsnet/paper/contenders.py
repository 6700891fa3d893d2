"""Which smoothers stand in Table 2: those of the paper under its names, and beyond them all others that there are."""

from __future__ import annotations

from dataclasses import dataclass

from gmsnet.measure.report import ASPECT
from gmsnet.mesh.mesh import Mesh
from gmsnet.methods import METHODS, Smoother, smoother
from gmsnet.run.api import smooth
from gmsnet.run.smooth_result import SmoothResult


@dataclass(frozen=True)
class Contender:
    """A row of the table. printed: its name in the paper, "" beyond it. variant, objective: "" where there are none."""

    printed: str
    method: str
    variant: str = ""
    objective: str = ""

    @property
    def key(self) -> str:
        """Names its results."""
        return "-".join(filter(None, (self.method, self.variant, self.objective)))

    @property
    def label(self) -> str:
        """What the tables call it."""
        return self.printed or ", ".join(filter(None, (self.method, self.variant, self.objective)))

    def smooth(self, mesh: Mesh, sweeps: int) -> SmoothResult:
        """The mesh smoothed as the paper's tables want it: one thread, and the best mesh is the best in 1/q_V."""
        return smooth(
            mesh, self.method, variant=self.variant or None, objective=self.objective or None, max_sweeps=sweeps,
            threads=1, best_by=ASPECT, guard="valid",
            preserve="none",
        )  # fmt: skip

    def smoother(self) -> Smoother:
        """Ready for one run."""
        return smoother(self.method, variant=self.variant or None, objective=self.objective or None)


OPTIM, NN, GMSNET, GETME, LAPLACIAN = "OptimSmoothing", "NN-Smoothing", "GMSNet", "GETMeSmoothing", "LaplacianSmoothing"
_PAPERS = {  # name in the paper → method; its default variant and objective are the paper's
    LAPLACIAN: "laplacian",
    "AngleSmoothing": "angle",
    "CVTSmoothing": "cvt",
    GETME: "getme",
    OPTIM: "optimize",
    NN: "nn",
    GMSNET: "gmsnet",
}


def papers() -> list[Contender]:
    """The seven methods of the paper's Table 2, in its order."""
    return [_default(printed, name) for printed, name in _PAPERS.items()]


def papers_own(printed: str) -> Contender:
    """The method that the paper calls so."""
    return _default(printed, _PAPERS[printed])


def beyond() -> list[Contender]:
    """All other methods, variants and objectives."""
    taken = {each.key for each in papers()}
    others = [
        Contender("", name, variant, objective)
        for name, method in METHODS.items()
        for variant in method.variants or ("",)
        for objective in method.objectives or ("",)
    ]
    return [each for each in others if each.key not in taken]


def named(key: str) -> Contender:
    """The contender with this key."""
    return next(each for each in (*papers(), *beyond()) if each.key == key)


def _default(printed: str, name: str) -> Contender:
    method = METHODS[name]
    return Contender(printed, name, *(names[0] if names else "" for names in (method.variants, method.objectives)))

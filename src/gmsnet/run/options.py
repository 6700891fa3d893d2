"""How a mesh is to be smoothed: all options in one object, checked when it is made."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from gmsnet.constraints.geometry import Geometry
from gmsnet.constraints.options import FEATURE_ANGLE, TOLERANCE, SlideChoice, check_sliding
from gmsnet.cuda.library import checked as gpu_library
from gmsnet.errors import InputError
from gmsnet.kernels.star.guard import LEVELS
from gmsnet.measure.report import ASPECT, SHAPE
from gmsnet.measure.target import Target
from gmsnet.methods import METHODS, Method, MethodOptions, Smoother, chosen
from gmsnet.parallel.threads import available_threads
from gmsnet.preserve.protection import METRIC, PRESERVE, method_for
from gmsnet.run.metric_options import check_adapting
from gmsnet.run.sweep import MOST_SWEEPS, Sweep

DEVICES = CPU, CUDA = "cpu", "cuda"
MOST_ANGLE, MOST_OF_QUADS = 60.0, 89.0  # degrees, of a minimum angle
MOST_DIHEDRAL = 70.5  # degrees; those of a regular tetrahedron are 70.53


@dataclass(frozen=True, kw_only=True)
class SmoothOptions:
    """The options of ``gmsnet.smooth``, whose documentation says what each means.

    Raises InputError for the first that cannot be used, with its name and what it must be: whole numbers may be
    NumPy's, but True and False are no numbers. What can only be told with a mesh at hand is not checked here: whether a
    file of weights can be read (``smoother``), and what depends on the mesh (``gmsnet.run.set_up``).
    """

    method: str = "auto"
    variant: str | None = None
    objective: str | None = None
    max_sweeps: int = MOST_SWEEPS
    threads: int | None = None
    target_quality: float | None = None
    target_angle: float | None = None
    target_dihedral: float | None = None
    preserve: str = SHAPE
    fix_layers: bool = False
    untangle: bool = True
    guard: str = "worst"
    seed: int = 0
    callback: Callable[[Sweep], bool | None] | None = None
    weights: str | os.PathLike[str] | None = None
    best_by: str = SHAPE
    slide: SlideChoice = None
    feature_angle: float = FEATURE_ANGLE
    geometry: Geometry | None = None
    surface_tolerance: float | None = None
    hausdorff: float | None = None
    free_needles: bool = False
    update_normals: bool = False
    join_regions: bool = False
    device: str = CPU
    metric: Any = field(default=None, compare=False)
    size: Any = field(default=None, compare=False)

    def __post_init__(self) -> None:
        _check_whole("max_sweeps", self.max_sweeps, 0)
        if self.threads is not None:
            _check_whole("threads", self.threads, 1)
        if self.target_quality is not None and not _is_number(self.target_quality, 1.0):
            raise InputError(
                f"target_quality is the minimum 1/q of a cell and must lie in (0, 1], got {self.target_quality!r}"
            )
        if self.target_angle is not None and not _is_number(self.target_angle, MOST_OF_QUADS):
            raise InputError(
                f"target_angle is the minimum angle of a cell in degrees and must lie in (0, {MOST_ANGLE:g}], of quads "
                f"alone in (0, {MOST_OF_QUADS:g}], got {self.target_angle!r}"
            )
        if self.target_dihedral is not None and not _is_number(self.target_dihedral, MOST_DIHEDRAL):
            raise InputError(
                "target_dihedral is the minimum dihedral angle of a tetrahedron in degrees and must lie in "
                f"(0, {MOST_DIHEDRAL}], got {self.target_dihedral!r}"
            )
        _check_whole("seed", self.seed, 0)
        if self.callback is not None and not callable(self.callback):
            raise InputError(f"callback must be a function that takes a Sweep, got {self.callback!r}")
        if self.weights is not None and not isinstance(self.weights, (str, os.PathLike)):
            raise InputError(f"weights must be the path of a safetensors file, got {self.weights!r}")
        _check_name("best_by", self.best_by, (SHAPE, ASPECT))
        _check_name("guard", self.guard, LEVELS)
        _check_name("preserve", self.preserve, PRESERVE)
        _check_flag("fix_layers", self.fix_layers)
        _check_flag("untangle", self.untangle)
        check_sliding(self.feature_angle, self.geometry)
        if self.surface_tolerance is not None and not _is_number(self.surface_tolerance, math.inf):
            raise InputError(
                "surface_tolerance is how far from the input's surface nodes may go, over the length of their edges, "
                f"and must be above 0, got {self.surface_tolerance!r}"
            )
        if self.hausdorff is not None and not _is_number(self.hausdorff, 1.0):
            raise InputError(
                "hausdorff is how far facets of a surface may go from the input's, over the diagonal of the box around "
                f"it, and must lie in (0, 1], got {self.hausdorff!r}"
            )
        _check_flag("free_needles", self.free_needles)
        _check_flag("update_normals", self.update_normals)
        _check_flag("join_regions", self.join_regions)
        _check_name("device", self.device, DEVICES)
        if self.device == CUDA:
            gpu_library()  # whether there is one is told before a file is read
        self._method()
        given = [name for name in ("metric", "size") if getattr(self, name) is not None]
        check_adapting(
            given, preserve=self.preserve, method=self.method, target=self.target, guard=self.guard,
            best_by=self.best_by,
        )  # fmt: skip

    @property
    def target(self) -> Target:
        """What every cell is to reach; false where nothing is asked for."""
        return Target(self.target_quality, self.target_angle, self.target_dihedral)

    @property
    def without_target(self) -> SmoothOptions:
        """The same for all cells."""
        return replace(self, target_quality=None, target_angle=None, target_dihedral=None)

    @property
    def thread_count(self) -> int:
        """At most so many threads are used."""
        return self.threads or available_threads()

    @property
    def asked(self) -> dict[str, Any]:
        """The options that are not as they are by default, but for the callback, as plain values: of arrays, functions
        and other objects what they are."""
        given = {each.name: (_told(getattr(self, each.name)), each.default) for each in fields(self)}
        given.pop("callback")
        return {name: value for name, (value, default) in given.items() if value != default}

    def smoother(self) -> Smoother:
        """The method, ready for one run. Raises InputError for weights that cannot be read."""
        method, options = self._method()
        if self.slides and not method.slides:
            able = ", ".join(name for name, row in METHODS.items() if row.slides)
            raise InputError(f"{method.name} cannot let nodes slide: leave out slide, or choose one of {able}")
        return method.create(options)

    @property
    def slides(self) -> bool:
        """May nodes of curves move along them?"""
        return self.slide is not None and self.slide is not False

    @property
    def distance(self) -> float:
        """How far from the input's facets nodes may go, over the length of their edges; a geometry is trusted."""
        return self.surface_tolerance or (TOLERANCE if self.geometry is None else math.inf)

    @property
    def adapts(self) -> bool:
        """Are cells to become those of a metric?"""
        return self.metric is not None or self.size is not None or self.preserve == METRIC

    @property
    def preserved(self) -> str:
        """What is preserved: with a metric or sizes that are given, these and nothing else."""
        return METRIC if self.adapts else self.preserve

    @property
    def method_name(self) -> str:
        """The method that is used: another one than ``method`` where sizes are to be kept."""
        return self._method()[0].name

    def _method(self) -> tuple[Method, MethodOptions]:
        name = method_for(self.method, self.variant, self.preserve, self.target)
        return chosen(name, variant=self.variant, objective=self.objective, weights=self.weights, seed=self.seed)


def _told(value: Any) -> Any:
    """An option as a plain value."""
    if isinstance(value, np.ndarray):
        return f"array of shape {value.shape}"
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, (list, tuple)):
        return [_told(each) for each in value]
    return getattr(value, "__name__", type(value).__name__)


def _check_whole(name: str, value: Any, least: int) -> None:
    if not (isinstance(value, (int, np.integer)) and not isinstance(value, bool) and value >= least):
        raise InputError(f"{name} must be a whole number of {least} or more, got {value!r}")


def _check_name(name: str, value: Any, names: tuple[str, ...]) -> None:
    if not isinstance(value, str) or value not in names:
        raise InputError(f"{name} must be one of {', '.join(map(repr, names))}; got {value!r}")


def _check_flag(name: str, value: Any) -> None:
    if not isinstance(value, (bool, np.bool_)):
        raise InputError(f"{name} must be True or False, got {value!r}")


def _is_number(value: Any, most: float) -> bool:
    numbers = (int, float, np.integer, np.floating)
    return isinstance(value, numbers) and not isinstance(value, bool) and bool(0.0 < value <= most)

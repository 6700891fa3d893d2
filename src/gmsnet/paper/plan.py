"""How much a reproduction does: the options of ``gmsnet reproduce`` and what follows from them."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from importlib.metadata import version
from importlib.resources import files
from typing import Any

from gmsnet.errors import InputError

WHAT = ("table1", "table2", "table3", "figures", "all")


@dataclass(frozen=True)
class Plan:
    """Raises InputError for numbers out of range.

    runs: seeds of each case. sweeps: at most so many in each run. seed: of the first run. quick: fewer and shorter
    trainings and timings, to see that everything works.
    """

    runs: int
    sweeps: int
    seed: int
    quick: bool

    def __post_init__(self) -> None:
        for name, least in (("runs", 1), ("sweeps", 1), ("seed", 0)):
            if getattr(self, name) < least:
                raise InputError(f"--{name} must be at least {least}, got {getattr(self, name)}")

    @classmethod
    def of(cls, runs: int | None, sweeps: int | None, seed: int, *, quick: bool) -> Plan:
        """What was asked for, by default the paper's ten runs of at most 100 sweeps, or 2 of 20 if it must be quick."""
        ordinary = (2, 20) if quick else (10, 100)
        return cls(ordinary[0] if runs is None else runs, ordinary[1] if sweeps is None else sweeps, seed, quick)

    @property
    def training_seeds(self) -> int:
        """How often each loss is trained with."""
        return 2 if self.quick else 5

    @property
    def epochs(self) -> int:
        """Of each training of the loss study."""
        return 24 if self.quick else 1000

    @property
    def timed_nodes(self) -> int:
        """How many nodes of a case each method in plain Python is timed on."""
        return 30 if self.quick else 600

    @property
    def timed_sweeps(self) -> int:
        """How many sweeps over a case each compiled method is timed on, from the mesh as it comes."""
        return 3 if self.quick else 10

    @property
    def timed_repeats(self) -> int:
        """How often those sweeps are repeated from the start."""
        return 3 if self.quick else 7

    def fingerprint(self) -> dict[str, Any]:
        """All that the results depend on: these options, the version of the package, and the weights in it."""
        return {
            "runs": self.runs,
            "sweeps": self.sweeps,
            "seed": self.seed,
            "quick": self.quick,
            "gmsnet": version("gmsnet"),
            "weights": _hashes(),
        }


def _hashes() -> dict[str, str]:
    """File of weights in the package → SHA-256 of it."""
    shipped = [each for each in files("gmsnet.weights").iterdir() if each.name.endswith(".safetensors")]
    return {each.name: hashlib.sha256(each.read_bytes()).hexdigest() for each in sorted(shipped, key=lambda f: f.name)}

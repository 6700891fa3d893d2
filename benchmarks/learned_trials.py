"""The trainings of GMSNet 2 that docs/learned.md tells of, each a command, and where their weights are kept.

    python benchmarks/learned_trials.py [--folder FOLDER] [--only NAME …] [--seeds 0 1 2]

Trains what the folder does not have yet; each takes two to three minutes on one core.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from gmsnet.learn.options import GMSNet2Options

FOLDER = Path("build/learned")
TRIALS = {
    "H=8": {},
    "H=4": {"hidden": 4},
    "single stars only": {"epochs": 2000},
}


def options_of(name: str, seed: int) -> GMSNet2Options:
    """How a trial is trained."""
    return GMSNet2Options(**TRIALS[name], seed=seed)


def weights_of(folder: Path, name: str, seed: int) -> Path:
    """Where the weights of a trial are, or will be."""
    options = options_of(name, seed)
    return (
        folder / options.command.replace("gmsnet train --model gmsnet2", "gmsnet2").replace(" ", "") / options.file_name
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--folder", type=Path, default=FOLDER)
    parser.add_argument("--only", nargs="+", choices=list(TRIALS), default=list(TRIALS))
    parser.add_argument("--seeds", nargs="+", type=int, default=[0, 1, 2])
    chosen = parser.parse_args()
    from gmsnet.learn.train import train

    for name in chosen.only:
        for seed in chosen.seeds:
            path = weights_of(chosen.folder, name, seed)
            if not path.exists():
                losses = train(options_of(name, seed), path.parent).losses
                print(f"{name}, seed {seed}: validation {losses['validation_loss']:.4f}, {path}", flush=True)


if __name__ == "__main__":
    main()

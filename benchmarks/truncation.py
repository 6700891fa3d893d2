"""Does training need truncation? GMSNet trained with it and without it, each loss from several seeds.

    python benchmarks/truncation.py [--epochs 600] [--seeds 3]

Prints the validation MetricLoss of the last tenth of the epochs (median), measured with truncation for both, so that
only the training differs, and beside it that before any move.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from statistics import median
from unittest import mock

from gmsnet.learn import train_gmsnet
from gmsnet.learn.backend import torch
from gmsnet.learn.losses import LOSSES, truncation
from gmsnet.learn.options import TrainOptions
from gmsnet.learn.train import train


def without_it(ring, degree, shift):
    """All shifts whole where weights learn; validation, which needs no gradient, keeps its truncation."""
    return shift.new_ones(len(shift)) if torch.is_grad_enabled() else truncation(ring, degree, shift)


def trained(loss, seed, epochs):
    with tempfile.TemporaryDirectory() as folder:
        return train(TrainOptions(loss=loss, seed=seed, epochs=epochs), Path(folder))


def end(result):
    rows = result.history["gmsnet"]
    return median(row.validation_metric_loss for row in rows[-max(1, len(rows) // 10) :])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--epochs", type=int, default=600)
    parser.add_argument("--seeds", type=int, default=3)
    options = parser.parse_args()
    for loss in LOSSES:
        for seed in range(options.seeds):
            with_it = trained(loss, seed, options.epochs)
            with mock.patch.object(train_gmsnet, "truncation", without_it):
                without = trained(loss, seed, options.epochs)
            print(
                f"{loss:14} seed {seed}: with {end(with_it):.4f} ({with_it.ending.value}), "
                f"without {end(without):.4f} ({without.ending.value})"
            )


if __name__ == "__main__":
    main()

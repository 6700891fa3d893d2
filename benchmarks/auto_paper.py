"""A method on the paper's four cases beside the paper's OptimSmoothing: qualities of every run, and times.

    python benchmarks/auto_paper.py [--method auto] [--variant V] [--objective O] [--runs 10] [--cases square circle …]
        [--repeats 3] [--json FILE]

A run is a seed of the case (``gmsnet.paper.cases``), the same for both. OptimSmoothing is smoothed as Table 2 of the
reproduction has it (guard "valid", the best mesh by 1/q_V, at most 100 sweeps), the other with the defaults of
``gmsnet.smooth``; both on one thread. In every run the other must have the larger least angle, the smaller largest
angle and the larger least 1/q_V; its mean angles and its mean 1/q_V, as means over the runs, may be behind by at most
1° and 0.01 (in how many runs each for itself is so is printed too). The rows that the paper prints stand beside. Times
are seconds of the thread for the whole call, in turns, medians.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path
from statistics import fmean, median

from machine import describe

import gmsnet
from gmsnet.paper import printed
from gmsnet.paper.cases import CASES
from gmsnet.paper.contenders import OPTIM, papers_own
from gmsnet.paper.qualities import figure

SWEEPS = 100
BEHIND = {"min_angle_mean": 1.0, "max_angle_mean": 1.0, "inv_q_mean": 0.01}
LOW_IS_GOOD = ("max_angle_max", "max_angle_mean")
BEATEN = ("min_angle_min", "max_angle_max", "inv_q_min")
TIE = 1e-9  # two methods that end at the cell's own optimum differ by rounding


def row(report):
    """The six columns of the paper's table."""
    summary = report.summary()
    return {column: figure(summary, column) for column in printed.COLUMNS}


def ahead(ours, theirs, column):
    """By how much the first is better than the second in a column."""
    return (theirs[column] - ours[column]) if column in LOW_IS_GOOD else (ours[column] - theirs[column])


def verdict(ours, theirs, column):
    """ "beats", "ties" or "loses" in a column of extremes; "ok" or "behind" in one of means."""
    lead = ahead(ours, theirs, column)
    if column in BEATEN:
        return "beats" if lead > TIE else "ties" if lead >= -TIE else "loses"
    return "ok" if lead >= -BEHIND[column] else "behind"


def compare(case, runs, smooth, repeats):
    """What both make of the runs of one case: rows, verdicts, seconds."""
    optim = papers_own(OPTIM)
    found = []
    for run in range(runs):
        mesh = CASES[case].mesh(run)
        ours, theirs = [], []
        for _ in range(repeats):
            ours.append(timed(lambda mesh=mesh: smooth(mesh)))
            theirs.append(timed(lambda mesh=mesh: optim.smooth(mesh, SWEEPS)))
        first, second = ours[-1][1], theirs[-1][1]
        rows = {"ours": row(first.after), "optim": row(second.after), "origin": row(first.before)}
        found.append(
            {
                **rows,
                "verdicts": {column: verdict(rows["ours"], rows["optim"], column) for column in printed.COLUMNS},
                "inverted": [first.after.inverted, second.after.inverted],
                "sweeps": [first.sweeps, second.sweeps],
                "seconds": [median(seconds for seconds, _ in each) for each in (ours, theirs)],
            }
        )
    return found


def timed(work):
    began = time.thread_time()
    result = work()
    return time.thread_time() - began, result


def table(case, found, name):
    """Means over the runs beside the paper's rows, and in how many runs what came out."""
    paper = printed.table2()
    print(f"\n{case}: means of {len(found)} runs")
    print(f"  {'':28}" + "".join(f"{column:>16}" for column in printed.COLUMNS))
    lines = {
        "origin": mean_row(found, "origin"),
        name: mean_row(found, "ours"),
        "OptimSmoothing, here": mean_row(found, "optim"),
        "OptimSmoothing, printed": paper[case, OPTIM].values,
        "GMSNet, printed": paper[case, "GMSNet"].values,
    }
    for label, values in lines.items():
        print(f"  {label:28}" + "".join(f"{values[column]:16.3f}" for column in printed.COLUMNS))
    counts = []
    for column in printed.COLUMNS:
        verdicts = [each["verdicts"][column] for each in found]
        counts.append(", ".join(f"{verdicts.count(one)} {one}" for one in dict.fromkeys(verdicts)))
    print(f"  {'runs':28}" + "".join(f"{text:>16}" for text in counts))
    least = [min(ahead(each["ours"], each["optim"], column) for each in found) for column in printed.COLUMNS]
    print(f"  {'least lead of a run':28}" + "".join(f"{value:16.4f}" for value in least))
    seconds = [median(each["seconds"][k] for each in found) for k in range(2)]
    print(f"  {seconds[0] * 1e3:.1f} ms and {seconds[1] * 1e3:.1f} ms for a call: {seconds[1] / seconds[0]:.1f} times")


def failures(case, found):
    """A line for each extreme that is not beaten in every run, and for each mean that is behind over all runs."""
    lines = []
    for column in BEATEN:
        if lost := [run for run, each in enumerate(found) if each["verdicts"][column] != "beats"]:
            lines.append(f"{case}: {column} is not better in the runs {lost}")
    ours, theirs = mean_row(found, "ours"), mean_row(found, "optim")
    for column in BEHIND:
        if verdict(ours, theirs, column) != "ok":
            lines.append(f"{case}: {column} is behind by {-ahead(ours, theirs, column):.4f}")
    return lines


def mean_row(found, which):
    return {column: fmean(each[which][column] for each in found) for column in printed.COLUMNS}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--method", default="auto")
    parser.add_argument("--variant")
    parser.add_argument("--objective")
    parser.add_argument("--runs", type=int, default=10)
    parser.add_argument("--cases", nargs="+", default=list(CASES), choices=list(CASES))
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--json")
    options = parser.parse_args()
    names = {"variant": options.variant, "objective": options.objective}

    def smooth(mesh):
        return gmsnet.smooth(mesh, options.method, **names, threads=1)

    print(describe())
    papers_own(OPTIM).smooth(CASES["square"].mesh(0), 1)  # compiled now, not in the first run
    gmsnet.smooth(CASES["square"].mesh(0), options.method, **names, threads=1)
    found = {}
    for case in options.cases:
        found[case] = compare(case, options.runs, smooth, options.repeats)
        table(case, found[case], " ".join(filter(None, (options.method, *names.values()))))
    if options.json:
        document = {"machine": describe(), "method": {"name": options.method, **names}, "cases": found}
        Path(options.json).write_text(json.dumps(document, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    inverted = sum(each["inverted"][0] for runs in found.values() for each in runs)
    lost = [line for case, runs in found.items() for line in failures(case, runs)]
    print("\n" + "\n".join(lost or ["all passed"]) + f"\n{inverted} inverted cells")
    return 0 if not lost and not inverted else 1


if __name__ == "__main__":
    sys.exit(main())

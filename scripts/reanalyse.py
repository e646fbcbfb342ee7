#!/usr/bin/env python3
"""Recomputes a run's main table from measurements.csv and the .hlog files, without Slateswarm's code.

    scripts/reanalyse.py RUN_DIRECTORY            prints size,strategy,metric,value,unit
    scripts/reanalyse.py RUN_DIRECTORY --check    also compares with summary.json; exit 1 if one differs

Needs Python 3.9 and the package hdrhistogram (module hdrh), which reads histogram logs of format V2.
What the columns mean stands in docs/data-dictionary.md.
"""

import argparse
import csv
import json
import pathlib
import re
import sys
from collections import defaultdict

from hdrh.histogram import HdrHistogram
from hdrh.log import HistogramLogReader

# Bounds of the histograms that the run wrote: 1 ns to a minute, three digits.
LOWEST_NS, HIGHEST_NS, DIGITS = 1, 60_000_000_000, 3
# A quantile is shown if at least so many values lie beyond it.
BEYOND_MIN = 10
QUANTILES = {"p50": 2, "p90": 10, "p99": 100, "p99.9": 1000, "p99.99": 10_000}
# Mean counts a trial: name in the summary, and the columns that add up to it.
COUNTS = {
    "requests": ["replication-requests"],
    "transmissions": ["replication-transmissions", "reply-transmissions"],
    "deliveries": ["replication-deliveries", "reply-deliveries"],
    "bytes": ["replication-bytes-sent", "reply-bytes-sent"],
    "hops": ["hops"],
    "turns": ["turns"],
}
# Trials with these ends are in no mean.
NOT_IN_MEANS = {"end-dropped", "end-partial"}
HISTOGRAM_NAME = re.compile(r"turn-time-block-(\d+)-crafts-(\d+)-(.+)\.hlog")


def counted(directory):
    """Sums of every fleet metric by (size, strategy) and trial, for trials that enter means."""
    trials = defaultdict(lambda: defaultdict(int))
    left_out = set()
    with open(directory / "measurements.csv", newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            if row["phase"] != "counted" or row["craft"] != "fleet":
                continue
            key = (int(row["size"]), row["strategy"], int(row["block"]), int(row["trial"]))
            if row["metric"] in NOT_IN_MEANS:
                left_out.add(key)
            trials[key][row["metric"]] += float(row["value"])
    cells = defaultdict(list)
    for key, metrics in trials.items():
        if key not in left_out:
            cells[key[:2]].append(metrics)
    return cells


def means(directory):
    """Mean counts a trial: {(size, strategy, metric): value}."""
    figures = {}
    for (size, strategy), trials in counted(directory).items():
        for name, columns in COUNTS.items():
            total = sum(trial[column] for trial in trials for column in columns)
            figures[size, strategy, name] = total / len(trials)
    return figures


def turn_times(directory):
    """Quantiles of turn time, all blocks together: {(size, strategy, metric): ns}."""
    cells = {}
    for path in sorted(directory.glob("turn-time-*.hlog")):
        _, size, strategy = HISTOGRAM_NAME.fullmatch(path.name).groups()
        whole = cells.setdefault(
            (int(size), strategy), HdrHistogram(LOWEST_NS, HIGHEST_NS, DIGITS)
        )
        reader = HistogramLogReader(str(path), HdrHistogram(LOWEST_NS, HIGHEST_NS, DIGITS))
        while (interval := reader.get_next_interval_histogram()) is not None:
            whole.add(interval)
    figures = {}
    for (size, strategy), whole in cells.items():
        count = whole.get_total_count()
        for name, one_beyond_in in QUANTILES.items():
            if count >= BEYOND_MIN * one_beyond_in:
                value = whole.get_value_at_percentile(100 - 100 / one_beyond_in)
                figures[size, strategy, f"turn-time-{name}"] = value
    return figures


def differences(directory, figures):
    """What differs from summary.json by more than the histograms' resolution."""
    summary = json.loads((directory / "summary.json").read_text(encoding="utf-8"))
    for part, is_timed in (("deterministic", False), ("timing", True)):
        for cell in summary[part]["cells"]:
            for metric, figure in cell["figures"].items():
                key = (cell["size"], cell["strategy"], metric)
                if metric.startswith("turn-time") != is_timed:
                    continue
                if key not in figures or figure["value"] is None:
                    continue
                ours, theirs = figures[key], figure["value"]
                tolerance = 10**-DIGITS if metric.startswith("turn-time") else 1e-9
                if abs(ours - theirs) > tolerance * max(abs(ours), 1):
                    yield f"{key}: recomputed {ours}, summary.json has {theirs}"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("directory", type=pathlib.Path)
    parser.add_argument("--check", action="store_true", help="compare with summary.json")
    arguments = parser.parse_args()
    figures = means(arguments.directory) | turn_times(arguments.directory)
    rows = csv.writer(sys.stdout)
    rows.writerow(["size", "strategy", "metric", "value", "unit"])
    for (size, strategy, metric), value in sorted(figures.items()):
        unit = "ns" if metric.startswith("turn-time") else "mean a trial"
        rows.writerow([size, strategy, metric, f"{value:g}", unit])
    if not arguments.check:
        return 0
    found = list(differences(arguments.directory, figures))
    for difference in found:
        print(difference, file=sys.stderr)
    print(f"{len(figures)} figures recomputed, {len(found)} differ", file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())

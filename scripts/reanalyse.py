#!/usr/bin/env python3
"""Recomputes a run's main tables from measurements.csv and the .hlog files, without Slateswarm's code.

    scripts/reanalyse.py RUN_DIRECTORY            prints size,strategy,load,asks_every_ns,metric,value,unit
    scripts/reanalyse.py RUN_DIRECTORY --check    also compares with summary.json; exit 1 if one differs

Needs Python 3.11 and the package hdrhistogram (module hdrh), which reads histogram logs of format V2.
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
# Costs under load: name in the summary, and the columns whose sum is divided by `needed`.
COSTS = {
    "cpu-per-application": ["cpu"],
    "requests-per-application": ["replication-requests"],
    "transmissions-per-application": ["replication-transmissions", "reply-transmissions"],
    "deliveries-per-application": ["replication-deliveries", "reply-deliveries"],
    "bytes-per-application": ["replication-bytes-sent", "reply-bytes-sent"],
}
# Shares under load, in percent: name in the summary, part and whole.
SHARES = {
    "applied-by-end-share": ("applied-by-end", "needed"),
    "stale-reads-share": ("stale-reads", "reads"),
}
# What recovery did, where the fleet recovers: sums over blocks, and their units.
RECOVERY = {
    "recovery-deaths": "process",
    "recovery-records-missed": "record",
    "recovery-lost-on-link": "sample",
    "recovery-cut-off-on-link": "sample",
    "recovery-doubled-on-link": "sample",
    "recovery-delayed-on-link": "sample",
    "recovery-overtaken-on-link": "sample",
    "recovery-dropped": "sample",
    "recovery-repeats": "sample",
    "recovery-given-up": "sample",
    "recovery-learnt": "change",
    "recovery-states-missed": "question",
}
UNITS = {"cpu-per-application": "ns", "cpu-per-application-over-null": "ns"}
# Of the histograms of a cell above capacity only this one has quantiles.
STALENESS = "staleness"


def quantile(histogram, one_beyond_in):
    """The value that all but one in so many do not exceed; None if too few lie beyond it."""
    count = histogram.get_total_count()
    if count < BEYOND_MIN * one_beyond_in:
        return None
    rank, passed = count - count // one_beyond_in, 0
    for step in histogram.get_recorded_iterator():
        passed += step.count_added_in_this_iter_step
        if passed >= rank:
            return step.value_iterated_to
    return None


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
        for name, one_beyond_in in QUANTILES.items():
            if (value := quantile(whole, one_beyond_in)) is not None:
                figures[size, strategy, f"turn-time-{name}"] = value
    return figures


def load_cells(directory):
    """Sums of every fleet metric under load: {(size, strategy, load, asks, block): {metric: value}}."""
    cells = defaultdict(lambda: defaultdict(float))
    with open(directory / "measurements.csv", newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            if row["phase"] == "loaded" and row["craft"] == "fleet":
                key = (int(row["size"]), row["strategy"], row["load"], row["asks_every_ns"])
                cells[(*key, int(row["block"]))][row["metric"]] += float(row["value"])
    return cells


def log_of(directory, size, strategy, load, asks, block):
    """The interval log of a cell, named as docs/data-dictionary.md says."""
    name, _, entry = strategy.partition(" (")
    again = "" if not entry else "-again-" + (entry.strip("again )") or "1")
    load = re.sub("[^0-9A-Za-z]", "-", load)
    asks = f"-asks-{int(asks) // 1000}us" if asks else ""
    return directory / f"load-{load}-block-{block}-crafts-{size}-{name}{asks}{again}.hlog"


def histograms(path):
    """Time to knowledge, and every tagged histogram, of one cell: {name: histogram}."""
    found = defaultdict(lambda: HdrHistogram(LOWEST_NS, HIGHEST_NS, DIGITS))
    reader = HistogramLogReader(str(path), HdrHistogram(LOWEST_NS, HIGHEST_NS, DIGITS))
    while (interval := reader.get_next_interval_histogram()) is not None:
        found[interval.get_tag() or "knowledge"].add(interval)
    return found


def loads(directory):
    """Figures of open mode: {(size, strategy, load, asks, metric): value}."""
    rows = defaultdict(dict)
    for key, metrics in load_cells(directory).items():
        rows[key[:4]][key[4]] = metrics
    figures = {}
    for row, blocks in rows.items():
        total = defaultdict(float)
        stages = defaultdict(lambda: HdrHistogram(LOWEST_NS, HIGHEST_NS, DIGITS))
        for block, metrics in blocks.items():
            for metric, value in metrics.items():
                total[metric] += value
            for name, histogram in histograms(log_of(directory, *row, block)).items():
                stages[name].add(histogram)
        if total["needed"]:
            for name, columns in COSTS.items():
                figures[*row, name] = sum(total[column] for column in columns) / total["needed"]
        for name, (part, whole) in SHARES.items():
            if total[whole]:
                figures[*row, name] = 100 * total[part] / total[whole]
        figures.update({(*row, name): total[name] for name in RECOVERY if name in total})
        for name, histogram in stages.items():
            if total["saturated"] and name != STALENESS:
                continue
            for point, one_beyond_in in QUANTILES.items():
                if (value := quantile(histogram, one_beyond_in)) is not None:
                    figures[*row, f"{name}-{point}"] = value
    for (size, strategy, load, asks, metric), value in list(figures.items()):
        floor = figures.get((size, "null", load, "", metric))
        if metric == "cpu-per-application" and strategy != "null" and floor is not None:
            figures[size, strategy, load, asks, f"{metric}-over-null"] = value - floor
    return figures


def label_of(row):
    """The strategy column of a row of the summary."""
    again = {0: "", 1: " (again)"}.get(row["again"], f" (again {row['again']})")
    return row["strategy"] + again


def load_differences(directory, figures):
    """What differs from summary.json under load; a figure that one side lacks differs as well."""
    summary = json.loads((directory / "summary.json").read_text(encoding="utf-8"))
    names = {metric for *_, metric in figures}
    for row in summary["timing"]["loads"]:
        asks = "" if row["asks_every_ns"] is None else str(row["asks_every_ns"])
        key = (row["size"], label_of(row), row["load"], asks)
        for metric in names:
            theirs = row["figures"].get(metric, {"value": None})["value"]
            ours = figures.get((*key, metric))
            if ours is None and theirs is None:
                continue
            is_quantile = metric.rpartition("-")[2] in QUANTILES
            tolerance = 10**-DIGITS if is_quantile else 1e-9
            if ours is None or theirs is None or abs(ours - theirs) > tolerance * max(abs(ours), 1):
                yield f"{(*key, metric)}: recomputed {ours}, summary.json has {theirs}"


def unit_of(metric):
    """The unit of a figure under load."""
    if metric in SHARES:
        return "%"
    if metric in RECOVERY:
        return RECOVERY[metric]
    if metric.endswith("-per-application"):
        return UNITS.get(metric, "a needed application")
    return "record" if metric.startswith("records-per-sample") else "ns"


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
    under_load = loads(arguments.directory)
    rows = csv.writer(sys.stdout)
    rows.writerow(["size", "strategy", "load", "asks_every_ns", "metric", "value", "unit"])
    for (size, strategy, metric), value in sorted(figures.items()):
        unit = "ns" if metric.startswith("turn-time") else "mean a trial"
        rows.writerow([size, strategy, "", "", metric, f"{value:g}", unit])
    for (*key, metric), value in sorted(under_load.items()):
        rows.writerow([*key, metric, f"{value:g}", unit_of(metric)])
    if not arguments.check:
        return 0
    found = list(differences(arguments.directory, figures))
    found += load_differences(arguments.directory, under_load)
    for difference in found:
        print(difference, file=sys.stderr)
    count = len(figures) + len(under_load)
    print(f"{count} figures recomputed, {len(found)} differ", file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())

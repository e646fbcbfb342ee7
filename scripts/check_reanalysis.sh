#!/usr/bin/env bash
# Runs a small fleet and recomputes its tables with scripts/reanalyse.py: every figure must agree, and a
# summary that says something else must be caught. Installs what the script needs below target/.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

python=target/reanalysis/bin/python
if ! "$python" -c 'import hdrh' 2>/dev/null; then
    python3 -m venv target/reanalysis
    "$python" -m pip install --quiet --disable-pip-version-check --requirement scripts/requirements.txt
fi
results=$(mktemp -d)
trap 'rm -rf "$results"' EXIT
cargo run --quiet --locked -- compare --sizes 2,3 --strategies null,full,central --trials 3 \
    --blocks 2 --out "$results" --quiet >"$results/table.txt"
run=$(realpath "$results/latest")
# So few writes that a busy host saturates nothing.
cargo run --quiet --locked -- run generated --set run.mode=open --set run.rate-per-s=300 \
    --set run.duration-s=1 --set trace.reads-per-s=300 --set run.asks-every-ms=[3] \
    --set link.loss=0.02 --blocks 2 \
    --strategies null,boundary,central --out "$results" --quiet >>"$results/table.txt"
loaded=$(realpath "$results/latest")
"$python" scripts/reanalyse.py "$run" --check >"$results/figures.csv"
"$python" scripts/reanalyse.py "$loaded" --check >"$results/loaded.csv"
for metric in requests bytes turn-time-p50; do
    grep -q "^3,full,,,$metric," "$results/figures.csv" || { echo "no $metric recomputed" >&2; exit 1; }
done
for metric in knowledge-p50 schedule-p50 cpu-per-application bytes-per-application recovery-repeats; do
    grep -q "^5,boundary,stated,,$metric," "$results/loaded.csv" ||
        { echo "no $metric under load recomputed" >&2; exit 1; }
done
"$python" - "$run/summary.json" "$loaded/summary.json" <<'PLANT'
import json, sys
for path in sys.argv[1:]:
    summary = json.load(open(path, encoding="utf-8"))
    for cell in summary["deterministic"]["cells"][-1:]:
        cell["figures"]["requests"]["value"] += 1
    for row in summary["timing"]["loads"][:1]:
        row["figures"]["cpu-per-application"]["value"] *= 1.01
    json.dump(summary, open(path, "w", encoding="utf-8"))
PLANT
for directory in "$run" "$loaded"; do
    if "$python" scripts/reanalyse.py "$directory" --check >/dev/null 2>&1; then
        echo 'a summary with a wrong figure went unnoticed' >&2
        exit 1
    fi
done
echo 'every figure was recomputed from the files, and a wrong one was caught'

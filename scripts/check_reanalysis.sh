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
    --out "$results" --quiet >"$results/table.txt"
run=$(realpath "$results/latest")
"$python" scripts/reanalyse.py "$run" --check >"$results/figures.csv"
for metric in requests bytes turn-time-p50; do
    grep -q "^3,full,$metric," "$results/figures.csv" || { echo "no $metric recomputed" >&2; exit 1; }
done
"$python" - "$run/summary.json" <<'PLANT'
import json, sys
summary = json.load(open(sys.argv[1], encoding="utf-8"))
summary["deterministic"]["cells"][-1]["figures"]["requests"]["value"] += 1
json.dump(summary, open(sys.argv[1], "w", encoding="utf-8"))
PLANT
if "$python" scripts/reanalyse.py "$run" --check >/dev/null 2>"$results/found.txt"; then
    echo 'a summary with a wrong figure went unnoticed' >&2
    exit 1
fi
echo 'every figure was recomputed from the files, and a wrong one was caught'

#!/usr/bin/env bash
# The raw baselines, then Slateswarm's turn beside them. See benches/README.md for what each prints.
# Usage: scripts/bench.sh [PAIRS]          PAIRS of raw round and turn, at least 9 (the default).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

cargo build --release --locked --workspace --bins
programs=${CARGO_TARGET_DIR:-target}/release
"$programs/raw-one-way"
"$programs/raw-round"
"$programs/turn-ratio" --pairs "${1:-9}"

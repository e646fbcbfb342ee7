#!/usr/bin/env bash
# The raw baselines, then Slateswarm's delta and turn beside them. See benches/README.md for what each
# prints.
# Usage: scripts/bench.sh [PAIRS]          PAIRS and triples of each ratio, at least 9 (the default).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

cargo build --release --locked --workspace --bins
programs=${CARGO_TARGET_DIR:-target}/release
for over in iceoryx2 datagrams blocking-datagrams; do "$programs/raw-one-way" --over "$over"; done
for over in iceoryx2 datagrams; do "$programs/raw-round" --over "$over"; done
for over in iceoryx2 datagrams; do "$programs/raw-capacity" --over "$over"; done
"$programs/delta-one-way"
"$programs/one-way-ratio" --triples "${1:-9}"
"$programs/turn-ratio" --pairs "${1:-9}"
cargo bench --locked -p slateswarm-benches --bench micro --bench reasoning

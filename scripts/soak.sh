#!/usr/bin/env bash
# Ten crafts under load for so many minutes, while crafts are killed and stopped and links lose samples;
# fails if memory, descriptors, shared memory or counters drift, or if something is not made up for. By
# hand an hour; in the checks half a minute with faults, and half a minute without.
# Usage: scripts/soak.sh [MINUTES] [OPTION...]     1 minute; further options as `soak --help` says.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

cargo build --release --locked -p slateswarm -p slateswarm-benches --bin slateswarm --bin soak
exec "${CARGO_TARGET_DIR:-target}/release/soak" "$@"

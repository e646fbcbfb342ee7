#!/usr/bin/env bash
# Ten crafts under load for so many minutes; fails if memory, descriptors, shared memory or counters
# drift. By hand an hour, in the checks a minute.
# Usage: scripts/soak.sh [MINUTES] [OPTION...]     1 minute; further options as `soak --help` says.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

cargo build --release --locked -p slateswarm -p slateswarm-benches --bin slateswarm --bin soak
exec "${CARGO_TARGET_DIR:-target}/release/soak" "$@"

#!/usr/bin/env bash
# Sets the published tables beside ours.
# Usage: scripts/reproduce.sh [TABLE] [OPTION...]
#        TABLE is table-21 to table-25 or all (the default); options as in `slateswarm reproduce --help`.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

exec cargo run --release --locked -p slateswarm -- reproduce "${@:-all}"

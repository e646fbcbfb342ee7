#!/usr/bin/env bash
# Everything that must hold before a change lands, from the fastest check to the slowest.
# Usage: scripts/check.sh          Each step prints its elapsed time; the first failure ends it.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# step NAME COMMAND...: runs the command under a heading and prints how long it took.
step() {
    local name=$1 begun=$SECONDS
    shift
    printf '== %s: %s\n' "$name" "$*"
    "$@" </dev/null
    printf '== %s: %d s\n' "$name" "$((SECONDS - begun))"
}

# The crates that hold no shell: they must stand without clock, shared memory and signals.
core=(-p slateswarm-shared-types -p slateswarm-agent --no-default-features)

step format cargo fmt --all --check
step lints cargo clippy --locked --workspace --all-targets -- -D warnings
step core-lints cargo clippy --locked "${core[@]}" --all-targets -- -D warnings
step core-tests cargo test --locked "${core[@]}"
step documentation env RUSTDOCFLAGS='-D warnings' cargo doc --locked --workspace --no-deps
step tests cargo test --locked --workspace
step soak scripts/soak.sh 0.5
step soak-without-faults scripts/soak.sh 0.5 --without-faults
step reanalysis scripts/check_reanalysis.sh
printf 'all checks passed in %d s\n' "$SECONDS"

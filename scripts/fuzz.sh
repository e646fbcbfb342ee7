#!/usr/bin/env bash
# Runs every fuzzer for so many seconds, one after the other, with stable Rust and a C++ compiler.
# Usage: scripts/fuzz.sh [SECONDS] [NAME...]     60 seconds each; all of them unless some are named.
#
# Corpora grow in shared-types/fuzz/corpus and orchestrator/fuzz/corpus; an input that breaks a law is
# left in fuzz/artifacts and ends the script. `cargo fuzz run --sanitizer none NAME` (inside one of the
# two crates) does the same on a machine that has cargo-fuzz.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

seconds=${1:-60}
shift || true
# What cargo-fuzz passes: coverage for libFuzzer, and the cfg under which the bodies are built.
export RUSTFLAGS="--cfg fuzzing -Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
-Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table \
-Cllvm-args=-sanitizer-coverage-trace-compares -Ccodegen-units=1"
triple=$(rustc -vV | sed -n 's/^host: //p')

# Temporary directories of fuzzers, which end without tidying up.
TMPDIR=$(mktemp -d)
export TMPDIR
trap 'rm -rf "$TMPDIR"' EXIT

for crate in shared-types orchestrator; do
    fuzz=$crate/fuzz
    names=()
    for target in "$fuzz"/fuzz_targets/*.rs; do
        name=$(basename "$target" .rs)
        [[ $name == seeds ]] || { [[ $# -gt 0 && " $* " != *" $name "* ]] || names+=("$name"); }
    done
    [[ ${#names[@]} -gt 0 ]] || continue
    # The versions that the product is built with.
    [[ -e $fuzz/Cargo.lock ]] || cp Cargo.lock "$fuzz/Cargo.lock"
    cargo build --quiet --release --manifest-path "$fuzz/Cargo.toml" --target "$triple"
    programs=$fuzz/target/$triple/release
    SEEDS=$TMPDIR/$crate "$programs/seeds" -runs=0 >"$TMPDIR/said" 2>&1
    for name in "${names[@]}"; do
        mkdir -p "$fuzz/corpus/$name" "$fuzz/artifacts/$name"
        printf '== %s: %s s\n' "$name" "$seconds"
        if ! "$programs/$name" -max_total_time="$seconds" -timeout=20 -report_slow_units=1 -rss_limit_mb=2048 \
            -print_final_stats=1 -artifact_prefix="$fuzz/artifacts/$name/" \
            "$fuzz/corpus/$name" "$TMPDIR/$crate/$name" >"$TMPDIR/said" 2>&1; then
            cat "$TMPDIR/said"
            exit 1
        fi
        grep -E 'DONE|number_of_executed_units|slowest_unit' "$TMPDIR/said"
    done
done

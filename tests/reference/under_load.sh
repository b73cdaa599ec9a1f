#!/bin/sh
# The tests again and again while two other processes want both cores; stops at the first pass that fails and shows what failed.
# A test that fails only then is a defect of the test.
#
#     sh tests/reference/under_load.sh        # 20 passes
#     sh tests/reference/under_load.sh 3
set -eu
cd "$(dirname "$0")/../.."
passes=${1:-20}
cargo test --locked --no-run
log=$(mktemp)
busy() { while :; do :; done; }
busy & first=$!
busy & second=$!
trap 'kill $first $second; rm -f "$log"' EXIT
trap 'exit 130' INT TERM

pass=1
while [ "$pass" -le "$passes" ]; do
    begun=$(date +%s)
    if ! cargo test --locked >"$log" 2>&1; then
        grep -E "FAILED|panicked|^failures:|^error" "$log" || true
        kept=$(mktemp) && cp "$log" "$kept"
        echo "pass $pass of $passes failed; its output: $kept"
        exit 1
    fi
    counted=$(awk '/^test result: ok/ { passed += $4 } END { print passed }' "$log")
    echo "pass $pass of $passes: $counted tests passed, $(($(date +%s) - begun)) s, load $(cut -d' ' -f1 /proc/loadavg)"
    pass=$((pass + 1))
done

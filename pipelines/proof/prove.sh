#!/bin/sh
# Conceal, diagnose blind, reveal: sh pipelines/proof/prove.sh DIR [options of `calib simulate conceal`]
# CALIB names the binary; verdicts that are there already are kept.
set -eu
calib=${CALIB:-calib}
here=$(cd "$(dirname "$0")" && pwd)
set_of=$1
shift
[ -e "$set_of/seal.json" ] || "$calib" simulate conceal --out "$set_of" "$@"
set_of=$(cd "$set_of" && pwd)
mkdir -p "$set_of/verdicts"
tables=$(mktemp -d)
trap 'rm -rf "$tables"' EXIT
for recording in "$set_of"/recordings/*/; do
    name=$(basename "$recording")
    verdict=$set_of/verdicts/$name.json
    [ -e "$verdict" ] && continue
    if "$calib" diagnose "$here/../case/pipeline.yaml" --set "case=$recording" --store "$tables/$name" --json --quiet > "$verdict.part"; then
        mv "$verdict.part" "$verdict"
    else
        rm -f "$verdict.part"
        echo "no verdict: $name" >&2
    fi
    rm -rf "${tables:?}/$name"
done
"$calib" simulate reveal "$set_of" --verdicts "$set_of/verdicts" --out "$set_of/scoreboard.parquet"

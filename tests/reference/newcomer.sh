#!/bin/sh
# The walk of somebody new by README.md alone, from a clone to a signed report; stops at the first step that does not work.
#
#     sh tests/reference/newcomer.sh            # builds calib first, as the README does
#     CALIB=target/debug/calib sh tests/reference/newcomer.sh
#
# Twelve other ways of writing one's files: tests/reference/newcomer_data.py; wrong set-ups: tests/reference/setups.py.
# The files of the "own" cell are those of a simulated robot with a concealed cause; its data sheet is pipelines/sr210d/robot.yaml.
set -eu
clone=$(cd "$(dirname "$0")/../.." && pwd)
cd "$clone"
if [ -z "${CALIB:-}" ]; then
    cargo build --no-default-features
    CALIB=target/debug/calib
fi
CALIB=$(cd "$(dirname "$CALIB")" && pwd)/$(basename "$CALIB")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
ln -s "$clone/pipelines" "$work/pipelines"
cd "$work"

echo "== the first example"
"$CALIB" run pipelines/sr210d/pipeline.yaml --quiet > first.txt
grep -q "^after .*200 held-out points of set check" first.txt

echo "== a concealed cause is named"
"$CALIB" simulate conceal --out cases --seed 6 --cases 1 --family zero_shift
"$CALIB" diagnose pipelines/case/pipeline.yaml --set case=cases/recordings/c0001 --quiet > found.txt
grep -q "the zero of joint 2 steps by 15 arcsec" found.txt

echo "== own data in five steps"
"$CALIB" simulate conceal --out own --seed 3 --cases 1 --family gear_cyclic --robot sr210d --points 150
mkdir cell7
cp own/recordings/c0001/controller.csv own/recordings/c0001/tracker.csv cell7/
"$CALIB" init cell7 --data cell7/controller.csv cell7/tracker.csv --robot spherical6
grep -q REPLACE cell7/robot.yaml
# The data sheet, and where the reflector of this recording sits.
sed 's/^tool: .*/tool: {point: [1835, 53, 1263]}/' pipelines/sr210d/robot.yaml > cell7/robot.yaml
sed -e 's/^ *# instrument: REPLACE.*/      instrument: {constant_um: 10, per_metre_um: 2.5, coverage: 2}/' \
    -e 's/^ *# limits: .*/      limits: {mean_mm: 0.3, max_mm: 0.8}/' \
    -e 's/^ *# identity: .*/      identity: {operator: A. Newcomer, robot serial: "7", tracker: AT960, date: 2026-10-01}/' \
    cell7/pipeline.yaml > edited.yaml
mv edited.yaml cell7/pipeline.yaml
"$CALIB" check cell7/pipeline.yaml > graph.txt
"$CALIB" run cell7/pipeline.yaml --quiet > result.txt
grep -q "^report *.calib/documents/cell7/report.html" result.txt
grep -q "A. Newcomer" .calib/documents/cell7/report.html

echo "== targets are corrected, and the store is whole"
printf 'name,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\nhome,10,-5,15,30,20,40\n' > targets.csv
"$CALIB" compensate cell7/pipeline.yaml targets.csv --out corrected.csv --quiet
grep -q "^home," corrected.csv
"$CALIB" verify
echo "== done"

#!/bin/sh
# Rows along lines and curves against the same rows in random order, and wandering noise alone: paths.sh OUT [SEED] [CASES]
# Needs calib on the PATH; run from the repository's root. Without a seed it draws one from /dev/urandom and prints it.
set -eu
out=$1
seed=${2:-$(od -An -N4 -tu4 /dev/urandom | tr -d ' ')}
cases=${3:-60}
echo "seed $seed"
for layout in path shuffled; do
    echo "== gears and wind-up, layout $layout"
    calib simulate prove --out "$out/$layout" --seed "$seed" --cases "$cases" --family gear_cyclic,joint_compliance --faulty 0 \
        --layout "$layout" --quiet
done
echo "== wandering noise and nothing else, layout path"
calib simulate prove --out "$out/wandering" --seed "$seed" --cases "$cases" --nulls 1 --faulty 0 --scatter wandering --layout path --quiet

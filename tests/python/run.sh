#!/usr/bin/env bash
# Builds the wheel from what `cargo test` compiled, installs it into a fresh virtual environment, and runs the tests of this folder.
# Needs Python 3.11 or newer with venv; arguments go to pytest.
set -euo pipefail
cd "$(dirname "$0")/../.."

python=${PYTHON:-python3}
"$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "Python 3.11 or newer is needed; name one with PYTHON=..." >&2; exit 1; }
target=$(realpath -m "${CARGO_TARGET_DIR:-target}")
work=$target/python
rm -rf "$work"
mkdir -p "$work"

# The profile of `cargo test`: the packages below calib are there already.
"$python" -m venv "$work/tools"
"$work/tools/bin/pip" install --quiet --disable-pip-version-check 'maturin>=1.9,<2'
begun=$(date +%s)
"$work/tools/bin/maturin" build --quiet --locked --profile dev --strip --compatibility linux --interpreter "$python" \
  --manifest-path src/python/Cargo.toml --out "$work/wheel"
echo "wheel: $(du -h "$work"/wheel/*.whl | cut -f1) after $(($(date +%s) - begun)) s"

"$python" -m venv "$work/fresh"
"$work/fresh/bin/pip" install --quiet --disable-pip-version-check "$work"/wheel/*.whl pytest pandas polars pyarrow matplotlib mujoco pin
# Where no Rust is, and not among the sources.
tests=$(pwd)/tests/python
cd "$work"
PATH="$work/fresh/bin:/usr/bin:/bin" MPLBACKEND=Agg "$work/fresh/bin/python" -m pytest -q -p no:cacheprovider "$tests" "$@"

#!/usr/bin/env bash
# Every check, quickest first; ends with pytest's own closing line.
set -euo pipefail
cd "$(dirname "$0")/.."
say() { printf '==> %s\n' "$*"; }
export QT_LOGGING_RULES=${QT_LOGGING_RULES:-qt.multimedia.*=false}
# Hundreds of processes load the same modules: what one has compiled need not be by all others.
unset PYTHONDONTWRITEBYTECODE

# Types take longest, on one core: everything else that needs no test runs beside them.
types=$(mktemp)
trap 'kill $(jobs -p) 2>/dev/null || true; rm -f "$types"' EXIT
.venv/bin/mypy >"$types" 2>&1 &
checked=$!
say "lint and format (ruff)"
.venv/bin/ruff check .
.venv/bin/ruff format --check .
say "documentation (mkdocs --strict)"
NO_MKDOCS_2_WARNING=1 .venv/bin/mkdocs build --strict --quiet
say "wheel"
scripts/check_wheel.sh
if [[ -e /usr/include/ros/ros.h ]]; then
  say "a node of roscpp to test against"
  .venv/bin/python tests/interop/ros1/peers/build_roscpp.py .pytest_cache/d/roscpp
fi
say "types (mypy --strict)"
failed=0
wait "$checked" || failed=$?
cat "$types"
((failed == 0)) || exit "$failed"
# Most tests wait for others most of the time: four side by side, each file in one process.
# Once more what failed: with other programs, machines under load can. Each is listed at the end.
# A process that crashes fails its test and is not replaced: the others would wait for it for ever.
# Files in the order of their folders: by default, those of few tests come last, which here are
# those that wait longest for others, and the end would be spent on waiting for one of them.
side_by_side=(-n 4 --dist loadfile --no-loadscope-reorder --max-worker-restart=0 --reruns 1
  --rerun-show-tracebacks)
version() { "$1/bin/python" -c 'import sys; print("%d.%d" % sys.version_info[:2])'; }
# Unit tests need no Qt: once for each Python is enough. Debian's has genpy to compare with.
say "unit tests, and what holds on every wire ($(.venv-system/bin/python -V), Debian's own)"
scripts/private_network.sh .venv-system/bin/python -m pytest -q "${side_by_side[@]}" tests/unit tests/contract "$@"
say "tests of interfaces in Qt 5 ($(.venv-system/bin/python -V), PySide2)"
scripts/private_network.sh .venv-system/bin/python -m pytest -q "${side_by_side[@]}" tests/gui "$@"
say "tests in RViz ($(.venv-system/bin/python -V))"
# Apart from tests/gui: a process has one Qt application, and RViz needs one of its own kind.
scripts/private_network.sh .venv-system/bin/python -m pytest -q "${side_by_side[@]}" tests/rviz "$@"
say "tests of interfaces in Qt 6, and with other programs ($(.venv/bin/python -V), PySide6)"
folders=(tests/gui tests/interop)
[ "$(version .venv)" = "$(version .venv-system)" ] || folders+=(tests/unit tests/contract)
scripts/private_network.sh .venv/bin/python -m pytest -q "${side_by_side[@]}" -m "not exhaustive" \
  "${folders[@]}" "$@"

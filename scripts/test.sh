#!/usr/bin/env bash
# Every check, quickest first; ends with pytest's own closing line.
set -euo pipefail
cd "$(dirname "$0")/.."
say() { printf '==> %s\n' "$*"; }
export QT_LOGGING_RULES=${QT_LOGGING_RULES:-qt.multimedia.*=false}
# Hundreds of processes load the same modules: what one has compiled need not be by all others.
unset PYTHONDONTWRITEBYTECODE

# Types take longest, on one core: they are checked beside everything else up to the unit tests, in
# the time that those leave, and must not slow them down.
types=$(mktemp)
output=$(mktemp)
interfaces=$(mktemp)
beside=
end() {
  kill $(jobs -p) 2>/dev/null || true
  [[ -z $beside ]] || kill -- "-$beside" 2>/dev/null || true
  rm -f "$types" "$output" "$interfaces"
}
trap end EXIT
trap 'exit 130' INT
nice -n 19 .venv/bin/mypy >"$types" 2>&1 &
checked=$!
say "lint and format (ruff)"
.venv/bin/ruff check .
.venv/bin/ruff format --check .
say "words (the glossary of CONTRIBUTING.md)"
.venv/bin/python scripts/words.py
say "documentation (mkdocs --strict)"
NO_MKDOCS_2_WARNING=1 .venv/bin/mkdocs build --strict --quiet
say "wheel"
scripts/check_wheel.sh
if [[ -e /usr/include/ros/ros.h ]]; then
  say "a node of roscpp to test against"
  .venv/bin/python tests/interop/ros1/peers/build_roscpp.py .pytest_cache/d/roscpp
fi
# Most tests wait for others most of the time: six side by side, each file in one process.
# RViz draws on the processor: four of them keep two cores busy.
# A process that crashes fails its test and is not replaced: the others would wait for it for ever.
# Files in the order of their folders, first those that wait for others: by default, those of few
# tests come last, which are the same here, and the end would be spent on waiting for one of them.
run() { # ENVIRONMENT PROCESSES ARGUMENT...
  local environment=$1 processes=$2
  shift 2
  scripts/private_network.sh "$environment/bin/python" -m pytest -q -n "$processes" --dist loadfile \
    --no-loadscope-reorder --max-worker-restart=0 "$@"
}
# Once more what failed, with windows and other programs: those can fail on machines under load.
# Each is listed at the end.
once_more=(--reruns 1 --rerun-show-tracebacks)
units=(tests/unit/ros[12] tests/contract tests/unit/[!r_]*/ tests/unit/test_*.py)
version() { "$1/bin/python" -c 'import sys; print("%d.%d" % sys.version_info[:2])'; }
# Unit tests need no Qt: once for each Python is enough. Debian's has genpy to compare with.
# The same holds for tests of interfaces that are marked `one_qt`: they run in Qt 6 only.
say "unit tests, and what holds on every wire ($(.venv-system/bin/python -V), Debian's own)"
run .venv-system 6 "${units[@]}" "$@"
say "types (mypy --strict)"
failed=0
wait "$checked" || failed=$?
cat "$types"
((failed == 0)) || exit "$failed"
say "tests of interfaces in Qt 5 ($(.venv-system/bin/python -V), PySide2)"
run .venv-system 6 "${once_more[@]}" -m "not one_qt" tests/gui "$@"
say "tests in RViz ($(.venv-system/bin/python -V))"
# Apart from tests/gui: a process has one Qt application, and RViz needs one of its own kind.
run .venv-system 4 "${once_more[@]}" tests/rviz "$@"
if [[ "$(version .venv)" != "$(version .venv-system)" ]]; then
  say "unit tests, and what holds on every wire ($(.venv/bin/python -V))"
  run .venv 6 -m "not exhaustive" "${units[@]}" "$@"
fi
say "tests of the 3D view ($(.venv/bin/python -V), PySide6)"
# Apart from tests/gui: it needs an X server, the others are drawn offscreen.
run .venv 3 "${once_more[@]}" tests/scene "$@"
# These two beside each other: interfaces keep the processor busy while programs wait for each other.
# One after the other where they would share a network, and with it ROS domains.
programs() {
  say "tests with other programs ($(.venv/bin/python -V))"
  run .venv "$1" "${once_more[@]}" -m "not exhaustive" tests/interop "${@:2}"
}
if scripts/private_network.sh sh -c '[ -n "${ROSGLASS_PRIVATE_NETWORK-}" ]' 2>/dev/null; then
  set -m # a process group of its own, to end all of it
  programs 4 "$@" >"$output" 2>&1 </dev/null &
  set +m
  beside=$!
fi
failed=0
say "tests of interfaces in Qt 6 ($(.venv/bin/python -V), PySide6)"
run .venv 4 "${once_more[@]}" tests/gui "$@" | tee "$interfaces" || failed=1
qt6_failed=$failed
if [[ -n $beside ]]; then
  wait "$beside" || failed=1
  beside=
  cat "$output"
else
  programs 6 "$@" || failed=1
fi
# The last line is not that of the others, which passed.
((qt6_failed == 0)) || tail -n 1 "$interfaces"
exit "$failed"

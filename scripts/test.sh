#!/usr/bin/env bash
# Every check, quickest first: scripts/test.sh [--all] [ARGUMENT OF PYTEST...]
#   --all  every test in both versions of Qt and in RViz, all mutants, and every type against every peer
# Runs all groups even if one has failed. Ends with the tests that failed, also those that passed on
# their rerun, with the seconds of each group and, in the last line, with pytest's closing line for
# all of them.
# BASE=COMMIT is what RViz's sources are compared with (scripts/unchanged.sh).
set -euo pipefail
cd "$(dirname "$0")/.."
all=
if [[ ${1-} == --all ]]; then
  all=1
  shift
fi
say() { printf '==> %s\n' "$*"; }
export QT_LOGGING_RULES=${QT_LOGGING_RULES:-qt.multimedia.*=false}
# Hundreds of processes load the same modules: what one has compiled need not be by all others.
unset PYTHONDONTWRITEBYTECODE

results=$(mktemp -d)
beside=()
end() {
  for process in "${beside[@]}"; do kill -- "-$process" 2>/dev/null || true; done
  rm -rf "$results"
}
trap end EXIT
trap 'exit 130' INT

# A group: prints its output, and notes its seconds, exit code and last line.
group() { # NAME COMMAND...
  local name=$1 begin=$SECONDS code=0 output
  shift
  say "$name"
  output=$(mktemp -p "$results")
  "$@" 2>&1 | tee "$output" || code=$?
  # No test of a group may match the arguments, as those of `-k`.
  ((code != 5)) || [[ -z ${arguments[*]-} ]] || code=0
  printf '%s\t%s\t%s\t%s\n' "$((SECONDS - begin))" "$code" "$name" "$(tail -n 1 "$output")" >>"$results/rows"
  grep -E '^(FAILED|ERROR|RERUN) tests/' "$output" | cut -c -200 >>"$results/failures" || true
  say "$name: $((SECONDS - begin)) s, exit code $code"
}
# A group that is not run, and why.
leave_out() { # NAME REASON
  say "$1: NOT RUN: $2"
  printf -- '-\t0\t%s\tnot run: %s\n' "$1" "$2" >>"$results/rows"
}
# Groups beside the following ones; `gather` waits for them and prints their output.
background() { # GROUP...
  local output
  output=$(mktemp -p "$results")
  set -m # a process group of its own, to end all of it
  "$@" >"$output" 2>&1 </dev/null &
  set +m
  beside+=($!)
  outputs+=("$output")
}
gather() {
  local at
  for at in "${!beside[@]}"; do
    wait "${beside[at]}" || true
    cat "${outputs[at]}"
  done
  beside=()
  outputs=()
}
outputs=()
arguments=("$@")

# Each file in one process; the processes of a group mostly wait for others.
# A process that crashes fails its test and is not replaced: the others would wait for it for ever.
# Files in the order of their folders, first those that wait for others: by default, those of few
# tests come last, which are the same here, and the end would be spent on waiting for one of them.
run() { # ENVIRONMENT PROCESSES ARGUMENT...
  local environment=$1 processes=$2
  shift 2
  scripts/private_network.sh "$environment/bin/python" -m pytest -q -n "$processes" --dist loadfile \
    --no-loadscope-reorder --max-worker-restart=0 "$@" "${arguments[@]}"
}
lint() { .venv/bin/ruff check . && .venv/bin/ruff format --check .; }
version() { "$1/bin/python" -c 'import sys; print("%d.%d" % sys.version_info[:2])'; }

# What tests/rviz depends on; the client below it has its own tests.
rviz_sources=(src/rosglass/{overlay,rviz,qml,qt,images,demo} tests/rviz tests/helpers tests/conftest.py
  examples pyproject.toml scripts/setup.sh scripts/test.sh)

# Once more what failed, with windows and other programs: those can fail on machines under load.
once_more=(--reruns 1 --rerun-show-tracebacks)
units=(tests/unit/ros[12] tests/contract tests/unit/[!r_]*/ tests/unit/test_*.py)
qt5="tests of interfaces in Qt 5 ($(.venv-system/bin/python -V), PySide2)"
qt6="tests of interfaces in Qt 6 ($(.venv/bin/python -V), PySide6)"
in_rviz="tests in RViz ($(.venv-system/bin/python -V))"
holds_everywhere="unit tests, and what holds on every wire"

# Three rows of groups side by side, each about as long as the others: only then are two cores busy,
# as programs mostly wait for each other, windows keep the processor busy, and unit tests do either.
with_programs() {
  if [[ -e /usr/include/ros/ros.h ]]; then
    group "a node of roscpp to test against" .venv/bin/python tests/interop/ros1/peers/build_roscpp.py .pytest_cache/d/roscpp
  fi
  group "tests with other programs ($(.venv/bin/python -V))" run .venv 5 "${once_more[@]}" tests/interop
}
# Apart from tests/gui: the 3D view needs an X server, other windows are drawn offscreen; and a
# process has one Qt application, of which RViz needs one of its own kind.
on_screens() {
  local reason
  if [[ -z $all ]] && reason=$(scripts/unchanged.sh "${rviz_sources[@]}"); then
    leave_out "$in_rviz" "$reason (make test-all runs them)"
  else
    group "$in_rviz" run .venv-system 4 "${once_more[@]}" tests/rviz
  fi
  if [[ -n $all ]]; then
    group "$qt5" run .venv-system 4 "${once_more[@]}" tests/gui
  else
    group "$qt5, where it can differ from Qt 6" run .venv-system 4 "${once_more[@]}" -m both_qt tests/gui
  fi
  group "tests of the 3D view ($(.venv/bin/python -V), PySide6)" run .venv 3 "${once_more[@]}" tests/scene
}

# Types take long, on one core: they begin first, and others go before them.
background group "types (mypy --strict)" nice -n 5 .venv/bin/mypy
group "lint and format (ruff)" lint
group "words (scripts/words.py)" .venv/bin/python scripts/words.py
# One row after the other where they would share a network, and with it ROS domains.
row=
if scripts/private_network.sh sh -c '[ -n "${ROSGLASS_PRIVATE_NETWORK-}" ]' 2>/dev/null; then
  row=background
fi
$row with_programs
$row on_screens
group "documentation (mkdocs --strict)" env NO_MKDOCS_2_WARNING=1 .venv/bin/mkdocs build --strict --quiet
group "wheel" scripts/check_wheel.sh
# Unit tests need no Qt: once for each Python is enough. Debian's has genpy to compare with.
system="$(.venv-system/bin/python -V), Debian's own"
if [[ -n $all ]]; then
  group "$holds_everywhere ($system), every mutant" run .venv-system 5 --exhaustive "${units[@]}"
else
  group "$holds_everywhere ($system), a tenth of the mutants" run .venv-system 5 "${units[@]}"
fi
if [[ "$(version .venv)" != "$(version .venv-system)" ]]; then
  group "$holds_everywhere ($(.venv/bin/python -V))" run .venv 5 -m "not exhaustive" "${units[@]}"
fi
group "$qt6" run .venv 5 "${once_more[@]}" tests/gui
gather
if [[ -s $results/failures ]]; then
  say "tests that failed; RERUN: once, and passed on their rerun unless they are also FAILED"
  sort -u "$results/failures"
fi
.venv/bin/python scripts/closing_line.py "$SECONDS" <"$results/rows"

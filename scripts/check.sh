#!/usr/bin/env bash
# The inner loop: style, types and the quick unit tests; `make test` runs the rest.
set -euo pipefail
cd "$(dirname "$0")/.."
unset PYTHONDONTWRITEBYTECODE
begin=$SECONDS
types=$(mktemp)
trap 'kill $(jobs -p) 2>/dev/null || true; rm -f "$types"' EXIT
.venv/bin/mypy >"$types" 2>&1 &
checked=$!
.venv/bin/ruff check .
.venv/bin/ruff format --check .
.venv/bin/python scripts/words.py
# Without the files that take longest: `make test` runs them. They wait for real seconds, start other
# programs, or try out a great many inputs.
slow=(test_setup test_terminal bags/test_decompression_bombs bags/test_replay comm/test_yaml_bombs
  interfaces/test_hostile messages/test_bounded messages/test_fuzz_conversions
  ros1/test_floods ros1/test_hostile_master ros1/test_registrations ros1/test_services
  ros1/test_type_fetching ros2/test_type_descriptions ros2/test_type_fetching tf/test_against_tf2)
ignored=("${slow[@]/#/--ignore=tests/unit/}")
ignored=("${ignored[@]/%/.py}")
echo "==> unit tests but those of ${#slow[@]} slow files"
scripts/private_network.sh .venv/bin/python -m pytest -q -n 6 --dist loadfile \
  --no-loadscope-reorder -m "not exhaustive" "${ignored[@]}" tests/unit "$@"
failed=0
wait "$checked" || failed=$?
cat "$types"
echo "checked in $((SECONDS - begin)) s"
exit "$failed"

#!/usr/bin/env bash
# Runs every benchmark on the environment it needs; each prints its figure and its ratio to a peer.
set -euo pipefail
cd "$(dirname "$0")/.."
scripts/setup.sh test
missed=()
# Others start what is left out here.
for script in $(grep -l __main__ benchmarks/*.py | grep -v -e _peers -e rviz_measure); do
  case $script in
    benchmarks/codec.py|benchmarks/imports.py|benchmarks/rviz_*.py) python=.venv-system/bin/python ;;
    *) python=.venv/bin/python ;;
  esac
  printf '\n==> %s\n' "$script"
  scripts/private_network.sh "$python" "$script" || missed+=("$script")
done
[ ${#missed[@]} -eq 0 ] || { printf '\nmissed a target or failed: %s\n' "${missed[*]}" >&2; exit 1; }

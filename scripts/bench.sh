#!/usr/bin/env bash
# Runs every benchmark on the environment it needs; each prints its figure and its ratio to a peer.
set -euo pipefail
cd "$(dirname "$0")/.."
scripts/setup.sh test
for script in $(grep -l __main__ benchmarks/*.py); do
  case $script in
    benchmarks/codec.py|benchmarks/imports.py) python=.venv-system/bin/python ;;
    *) python=.venv/bin/python ;;
  esac
  printf '\n==> %s\n' "$script"
  "$python" "$script"
done

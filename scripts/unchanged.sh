#!/usr/bin/env bash
# Checks whether files are the same as in the commit that this one is compared with:
# scripts/unchanged.sh PATH...
# Succeeds and prints why they count as unchanged, or fails: they changed, or there is no commit to
# compare with. That commit is $BASE, or else where this branch left origin/main. On origin/main itself it
# is the first parent of a merge; any other commit there may be one of many that were pushed together.
set -euo pipefail
head=$(git rev-parse --verify --quiet HEAD)
if [[ -n ${BASE-} ]]; then
  base=$(git rev-parse --verify "$BASE^{commit}")
else
  base=$(git merge-base HEAD origin/main 2>/dev/null)
  if [[ $base == "$head" ]]; then
    git rev-parse --verify --quiet HEAD^2 >/dev/null
    base=$(git rev-parse HEAD^1)
  fi
fi
git diff --quiet "$base" -- "$@"
[[ -z $(git status --porcelain -- "$@") ]]
echo "unchanged since ${base:0:12}"

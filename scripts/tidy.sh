#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Runs clang-tidy, with the checks of .clang-tidy, on the sources that differ from a commit.
#
#   bash scripts/tidy.sh [COMMIT|all]
#
# COMMIT is HEAD by default: what is not committed yet. It needs the configured tree build/release.
set -euo pipefail
cd "$(dirname "$0")/.."

base=${1:-HEAD}
if [ "$base" = all ]; then
  mapfile -t sources < <(git ls-files 'src/*.cpp' 'examples/programs/*.cpp')
else
  mapfile -t sources < <(git diff --name-only --diff-filter=d "$base" -- 'src/*.cpp' 'examples/programs/*.cpp')
fi
if [ ${#sources[@]} -eq 0 ]; then
  echo "tidy.sh: no source differs from $base" >&2
  exit 0
fi
printf '%s\0' "${sources[@]}" |
  xargs -0 -n 1 -P "$(nproc)" clang-tidy -p build/release --quiet --warnings-as-errors='*'

#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Checks what needs no build: format, SPDX lines, and that the documentation site has no warning.
#
#   bash scripts/style.sh [--fix]
#
# --fix formats the files instead of complaining. clang-format 14 decides: other versions break lines elsewhere.
set -euo pipefail
cd "$(dirname "$0")/.."

format=$(command -v clang-format-14) || { echo "style.sh: clang-format-14 is missing (scripts/install_dependencies.sh)" >&2; exit 1; }
mapfile -t sources < <(git ls-files '*.h' '*.hpp' '*.cpp')
if [ "${1:-}" = --fix ]; then
  "$format" -i "${sources[@]}"
fi
"$format" --dry-run -Werror "${sources[@]}"
wide=$(awk 'length > 100 { print FILENAME ":" FNR }' "${sources[@]}")
if [ -n "$wide" ]; then
  printf 'style.sh: lines of more than 100 columns:\n%s\n' "$wide" >&2
  exit 1
fi

mapfile -t marked < <(git ls-files '*.h' '*.hpp' '*.cpp' '*.h.in' '*.sh' '*.py' '*.cmake' '*CMakeLists.txt' | grep -v '^examples/consumer/')
unmarked=$(grep -L --max-count=1 'SPDX-License-Identifier: BSD-3-Clause' "${marked[@]}" || true)
if [ -n "$unmarked" ]; then
  printf 'style.sh: no SPDX line in\n%s\n' "$unmarked" >&2
  exit 1
fi

bash scripts/docs.sh

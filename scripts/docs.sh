#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Makes the documentation site from the public headers and the pages in docs, with Doxygen. Each
# warning is an error.
#
#   bash scripts/docs.sh [FOLDER]
#
# FOLDER is where the site goes, default: build/docs.
set -euo pipefail
output=$(realpath -m "${1:-$(dirname "$0")/../build/docs}")
cd "$(dirname "$0")/.."

if ! command -v doxygen >/dev/null; then
  echo "docs.sh: doxygen is missing; install it with: sudo apt install doxygen" >&2
  exit 1
fi
version=$(sed -n 's/^project(bundle_icp VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)
mkdir -p "$output"
{
  cat docs/Doxyfile
  echo "PROJECT_NUMBER = $version"
  echo "OUTPUT_DIRECTORY = \"$output\""
} | doxygen -
echo "Wrote $output/html/index.html" >&2

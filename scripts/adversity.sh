#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The whole adversity suite: recordings as people have them, spoiled in every way that we know of.
# Prints a table and the counts; fails on a silent fault that test/adversity/known_faults.h lacks.
#
#   bash scripts/adversity.sh [BUILD] [NAME|KIND...] [-o OUT] [--keep] [--fast]
#
# BUILD: build folder, build/release by default. A name or kind limits the inputs.
set -euo pipefail
build=$(dirname "$0")/../build/release
if [ -d "${1:-}" ]; then
  build=$1
  shift
fi
exec "$build/test/adversity/bundle_icp_adversity" "$@"

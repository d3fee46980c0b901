#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Damages each kind of input file at random (bits, bytes, the end; numbers and lines of text) and runs
# bundle_icp_reconstruct or bundle_icp_evaluate on it. Prints counts for each kind, and what was done
# where the result is bad or silent: bad is a crash, a hang, more than 2 GiB of memory and an error that
# names no file; silent is a wrong result without a warning. Fails when one is bad.
#
#   bash scripts/mutants.sh [COUNT] [SEED]
#
# COUNT of each kind, 300 by default; SEED 1. The programs are those in build/release.
set -euo pipefail
exec "$(dirname "$0")/../build/release/test/adversity/bundle_icp_mutants" "$@"

#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# All that a change must pass: format and documents, clang-tidy on sources that are not committed yet,
# all tests in Release, warnings of GCC and Clang as errors, the quick unit tests with the address and
# undefined-behaviour sanitizers, and 20 s of each fuzzer. Ends at the first failure.
#
#   bash scripts/test.sh [--quick]
#
# --quick: format and documents, and in Release all tests but the slowest.
set -euo pipefail
cd "$(dirname "$0")/.."

quick=${1:-}
if [ -n "$quick" ] && [ "$quick" != --quick ]; then
  echo "test.sh: unknown argument $quick; expected --quick or none" >&2
  exit 2
fi

bash scripts/install_dependencies.sh --checks
options=(-G Ninja)
if command -v ccache >/dev/null; then
  options+=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
fi
bash scripts/style.sh

cmake -S . -B build/release "${options[@]}" -DCMAKE_BUILD_TYPE=Release \
  -DBUNDLE_ICP_WARNINGS_AS_ERRORS=ON -DCMAKE_EXPORT_COMPILE_COMMANDS=ON
cmake --build build/release --parallel "$(nproc)"
bash scripts/tidy.sh
if [ "$quick" = --quick ]; then
  ctest --test-dir build/release --parallel 2 --output-on-failure \
    --exclude-regex 'RegisteredPoses|install|BenchmarkProgram|ReconstructCalibration'
  exit
fi
ctest --test-dir build/release --parallel 2 --output-on-failure

# With Clang and the sanitizers: all of the code for its warnings, the tests of what reads foreign bytes and
# of what all else rests on, and the fuzzers for a moment. The other rooms: scripts/sanitizers.sh.
bash scripts/sanitizers.sh common io mesh graph model virtual_depth
bash scripts/fuzz.sh 20

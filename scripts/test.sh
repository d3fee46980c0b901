#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# All that a change must pass: format and documents, clang-tidy on sources that are not committed yet,
# all tests in Release, warnings of GCC and Clang as errors, and 20 s of each fuzzer. Ends at the first
# failure. The unit tests with sanitizers: scripts/sanitizers.sh.
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
# Two tests run at once, with two threads each: threads that wait must not keep the others waiting.
export OMP_WAIT_POLICY=passive
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

# The library and the programs once with Clang, for its warnings: nothing runs.
cmake -S . -B build/clang "${options[@]}" -DCMAKE_C_COMPILER=clang -DCMAKE_CXX_COMPILER=clang++ \
  -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_FLAGS_DEBUG=-O0 -DBUNDLE_ICP_BUILD_TESTS=OFF \
  -DBUNDLE_ICP_WARNINGS_AS_ERRORS=ON
cmake --build build/clang --parallel "$(nproc)"

bash scripts/fuzz.sh 20

#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# All that a change must pass: format and documents, clang-tidy on sources that are not committed yet,
# all tests in Release, warnings of GCC and Clang as errors, the unit tests with the address and
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

# Once more with Clang: its warnings, the unit tests with the sanitizers, and the fuzzers for a moment. -O1
# keeps the instrumented code quick to compile and to run; without -DNDEBUG, as it is here, Eigen checks its
# indices and alignment as well. The programs are built for their warnings alone: their tests ran above.
# PCL's and OpenCV's dependencies keep some memory until the end: leaks are not looked for.
export ASAN_OPTIONS=detect_leaks=0 UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1
cmake -S . -B build/sanitizers "${options[@]}" -DCMAKE_C_COMPILER=clang -DCMAKE_CXX_COMPILER=clang++ \
  -DCMAKE_BUILD_TYPE=RelWithDebInfo -DCMAKE_CXX_FLAGS_RELWITHDEBINFO="-O1 -g1" \
  -DBUNDLE_ICP_WARNINGS_AS_ERRORS=ON -DBUNDLE_ICP_SANITIZE=address,undefined -DBUNDLE_ICP_FUZZ=ON
cmake --build build/sanitizers --parallel "$(nproc)"
ctest --test-dir build/sanitizers --parallel 2 --output-on-failure --exclude-regex 'test_examples|^adversity$'
bash scripts/fuzz.sh 20

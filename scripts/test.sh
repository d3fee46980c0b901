#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Builds and runs all tests in Release, warnings being errors, and the unit tests with the address and
# undefined-behaviour sanitizers. Ends at the first failure; ctest's summary comes last.
set -euo pipefail
cd "$(dirname "$0")/.."

bash scripts/install_dependencies.sh
options=(-G Ninja)
if command -v ccache >/dev/null; then
  options+=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
fi

cmake -S . -B build/release "${options[@]}" -DCMAKE_BUILD_TYPE=Release \
  -DBUNDLE_ICP_WARNINGS_AS_ERRORS=ON
cmake --build build/release --parallel "$(nproc)"
ctest --test-dir build/release --parallel 2 --output-on-failure

# PCL's and OpenCV's dependencies keep some memory until the end: leaks are not looked for.
export ASAN_OPTIONS=detect_leaks=0 UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1
# -O1 keeps the instrumented code quick to compile and to run; without -DNDEBUG, as it is here,
# Eigen checks its indices and alignment as well. Of the unit tests only: the tests of the programs
# skip themselves where the programs are not built.
cmake -S . -B build/sanitizers "${options[@]}" -DCMAKE_BUILD_TYPE=RelWithDebInfo \
  -DCMAKE_CXX_FLAGS_RELWITHDEBINFO="-O1 -g1" -DBUNDLE_ICP_SANITIZE=address,undefined \
  -DBUNDLE_ICP_BUILD_EXAMPLES=OFF
cmake --build build/sanitizers --parallel "$(nproc)"
ctest --test-dir build/sanitizers --parallel 2 --output-on-failure

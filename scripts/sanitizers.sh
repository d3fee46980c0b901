#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Runs the unit tests with the address and undefined-behaviour sanitizers, by Clang.
#
#   bash scripts/sanitizers.sh [ROOM...]
#
# ROOM: a folder of test/ whose tests are built and run; all by default, which takes an hour on two cores.
set -euo pipefail
cd "$(dirname "$0")/.."

# The tests of the programs skip themselves where the programs are not built.
options=(-G Ninja)
if command -v ccache >/dev/null; then
  options+=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
fi
# -O1 keeps the instrumented code quick to compile and to run; without -DNDEBUG, as it is here, Eigen checks
# its indices and alignment as well.
cmake -S . -B build/sanitizers "${options[@]}" -DCMAKE_C_COMPILER=clang -DCMAKE_CXX_COMPILER=clang++ \
  -DCMAKE_BUILD_TYPE=RelWithDebInfo -DCMAKE_CXX_FLAGS_RELWITHDEBINFO="-O1 -g1" \
  -DBUNDLE_ICP_SANITIZE=address,undefined -DBUNDLE_ICP_FUZZ=ON -DBUNDLE_ICP_BUILD_EXAMPLES=OFF

# PCL's and OpenCV's dependencies keep some memory until the end: leaks are not looked for.
export ASAN_OPTIONS=detect_leaks=0 UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1
run=(ctest --test-dir build/sanitizers --parallel 2 --output-on-failure)
if [ $# -eq 0 ]; then
  cmake --build build/sanitizers --parallel "$(nproc)"
  "${run[@]}"
else
  tests=("${@/#/bundle_icp_test_}")
  cmake --build build/sanitizers --parallel "$(nproc)" --target "${tests[@]}"
  "${run[@]}" --tests-regex "^($(IFS='|' && echo "${tests[*]}"))\$"
fi

#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Builds library and programs with Clang, its warnings as errors, and runs the unit tests with the address
# and undefined-behaviour sanitizers.
#
#   bash scripts/sanitizers.sh [ROOM...]
#
# ROOM: a folder of test/ whose tests are built and run; all by default, which takes about half an hour.
set -euo pipefail
cd "$(dirname "$0")/.."

options=(-G Ninja)
if command -v ccache >/dev/null; then
  options+=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
fi
# -O1 keeps the instrumented code quick to compile and to run; without -DNDEBUG, as it is here, Eigen checks
# its indices and alignment as well.
cmake -S . -B build/sanitizers "${options[@]}" -DCMAKE_C_COMPILER=clang -DCMAKE_CXX_COMPILER=clang++ \
  -DCMAKE_BUILD_TYPE=RelWithDebInfo -DCMAKE_CXX_FLAGS_RELWITHDEBINFO="-O1 -g1" \
  -DBUNDLE_ICP_WARNINGS_AS_ERRORS=ON -DBUNDLE_ICP_SANITIZE=address,undefined -DBUNDLE_ICP_FUZZ=ON

# PCL's and OpenCV's dependencies keep some memory until the end: leaks are not looked for.
export ASAN_OPTIONS=detect_leaks=0 UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1
run=(ctest --test-dir build/sanitizers --parallel 2 --output-on-failure)
# The programs are built for their warnings alone: their tests run in Release.
if [ $# -eq 0 ]; then
  cmake --build build/sanitizers --parallel "$(nproc)"
  "${run[@]}" --exclude-regex 'test_examples|^adversity$'
else
  tests=("${@/#/bundle_icp_test_}")
  cmake --build build/sanitizers --parallel "$(nproc)" --target examples/all "${tests[@]}"
  "${run[@]}" --tests-regex "^($(IFS='|' && echo "${tests[*]}"))\$"
fi

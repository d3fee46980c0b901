#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Runs the unit tests of the parallel code under ThreadSanitizer. Arguments are patterns of test
# names instead of the default ones, as for --gtest_filter.
#
# GCC's libgomp is not instrumented: ThreadSanitizer would see neither that a loop's threads end
# before the code after it begins, and report races that are none, nor could it be told to ignore
# that runtime without becoming blind to the loops themselves. Clang's libomp tells ThreadSanitizer
# of its barriers through LLVM's archer, which comes with it, so that what is left are real races.
set -euo pipefail
cd "$(dirname "$0")/.."

for program in clang++ cmake ninja; do
  command -v "$program" >/dev/null || { echo "$program is missing (apt install clang libomp-dev)" >&2; exit 1; }
done
archer=$(find "$(clang++ -print-resource-dir)/../../.." /usr/lib/llvm-* -name libarcher.so 2>/dev/null | head -1)
[ -n "$archer" ] || { echo "libarcher.so is missing (apt install libomp-dev)" >&2; exit 1; }

launcher=()
if command -v ccache >/dev/null; then
  launcher=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
fi
cmake -S . -B build/thread -G Ninja -DCMAKE_C_COMPILER=clang -DCMAKE_CXX_COMPILER=clang++ \
  -DCMAKE_BUILD_TYPE=RelWithDebInfo -DCMAKE_CXX_FLAGS_RELWITHDEBINFO="-O1 -g1" \
  -DBUNDLE_ICP_SANITIZE=thread -DBUNDLE_ICP_BUILD_EXAMPLES=OFF "${launcher[@]}"

# Libraries that were built without ThreadSanitizer, as PCL and OpenCV are, synchronise in ways that
# it cannot see.
export OMP_TOOL_LIBRARIES=$archer
export TSAN_OPTIONS="ignore_noninstrumented_modules=1 report_mutex_bugs=0 ${TSAN_OPTIONS:-}"
rooms=(graph virtual_depth model adjustment refinement registration mapping volume mesh baselines simulation)
cmake --build build/thread --parallel "$(nproc)" --target "${rooms[@]/#/bundle_icp_test_}"

export OMP_NUM_THREADS=4 # also on fewer cores; not before, as nproc obeys it
filter=${*:-*Thread*}
for room in "${rooms[@]}"; do
  "build/thread/test/$room/bundle_icp_test_$room" --gtest_filter="${filter// /:}" --gtest_brief=1
done

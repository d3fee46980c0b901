#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Feeds all readers with damaged files, under the address and undefined-behaviour sanitizers. Fails on a
# crash, a hang of 10 s, and more than 1 GiB of memory; the input that did it stays in build/fuzz.
#
#   bash scripts/fuzz.sh [SECONDS]
#
# SECONDS for each program, 600 by default.
set -euo pipefail
cd "$(dirname "$0")/.."

seconds=${1:-600}
options=(-G Ninja)
if command -v ccache >/dev/null; then
  options+=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
fi
cmake -S . -B build/sanitizers "${options[@]}" -DCMAKE_C_COMPILER=clang -DCMAKE_CXX_COMPILER=clang++ \
  -DCMAKE_BUILD_TYPE=RelWithDebInfo -DCMAKE_CXX_FLAGS_RELWITHDEBINFO="-O1 -g1" -DBUNDLE_ICP_FUZZ=ON \
  -DBUNDLE_ICP_SANITIZE=address,undefined -DBUNDLE_ICP_BUILD_EXAMPLES=OFF
cmake --build build/sanitizers --parallel "$(nproc)" --target bundle_icp_fuzz_files bundle_icp_fuzz_recordings

export ASAN_OPTIONS=detect_leaks=0:allocator_may_return_null=0 UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1
for name in files recordings; do
  mkdir -p build/fuzz/corpus_$name
  build/sanitizers/test/fuzz/bundle_icp_fuzz_$name -max_total_time="$seconds" -timeout=10 -rss_limit_mb=1024 \
    -max_len=16384 -artifact_prefix=build/fuzz/ -print_final_stats=1 -print_funcs=0 -verbosity=0 \
    build/fuzz/corpus_$name test/fuzz/corpus/$name
done

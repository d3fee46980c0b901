#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# From nothing to a mesh: builds bundle_icp in build/demo, simulates a hand-held scan of a room
# with the faults of a real camera, reconstructs it, and compares poses and mesh with the truth.
# Everything it makes lies in build/demo and demo; running it again begins anew.
set -euo pipefail
cd "$(dirname "$0")/.."

bash scripts/install_dependencies.sh
launcher=()
if command -v ccache >/dev/null; then
  launcher=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
fi
cmake -S . -B build/demo -G Ninja -DCMAKE_BUILD_TYPE=Release -DBUNDLE_ICP_BUILD_TESTS=OFF "${launcher[@]}"
cmake --build build/demo --parallel "$(nproc)"

programs=build/demo/bin
rm -rf demo/scan # a recording is only ever written to an empty folder
"$programs/bundle_icp_simulate" demo/scan --frames 60 --full-noise
"$programs/bundle_icp_reconstruct" demo/scan -o demo/result
echo
"$programs/bundle_icp_evaluate" demo/scan demo/result/trajectory.txt \
  --mesh demo/result/mesh.ply --surface demo/scan/surface.ply
echo
echo "Mesh:    $PWD/demo/result/mesh.ply"
echo "Picture: $PWD/demo/result/mesh.png"

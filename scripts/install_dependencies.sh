#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Installs what bundle_icp is built from, on Debian 12 and Ubuntu 24.04. Ubuntu 22.04
# needs Ceres 2.1 and GCC 12 from elsewhere.
# With --checks also what scripts/test.sh needs besides. Where everything is there already it does
# nothing, and needs no rights.
set -euo pipefail

packages=(
  build-essential cmake ninja-build ccache
  libpcl-dev libopencv-dev libceres-dev
  libflann-dev libeigen3-dev
  libboost-dev libboost-filesystem-dev libboost-program-options-dev libboost-serialization-dev
  nlohmann-json3-dev liblz4-dev zlib1g-dev libsqlite3-dev
  libgtest-dev libgmock-dev libbenchmark-dev
)
# What scripts/test.sh checks with besides: format, a second compiler, the documentation.
if [ "${1:-}" = --checks ]; then
  packages+=(clang clang-format-14 clang-tidy libomp-dev doxygen)
fi

missing=()
for package in "${packages[@]}"; do
  status=$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null || true)
  [ "$status" = installed ] || missing+=("$package")
done
if [ ${#missing[@]} -eq 0 ]; then
  exit 0
fi

as_root=()
if [ "$(id -u)" -ne 0 ]; then
  as_root=(sudo)
fi
echo "Installing ${missing[*]}" >&2
"${as_root[@]}" apt-get update
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends "${missing[@]}"

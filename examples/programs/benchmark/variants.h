// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/reconstruction.h>

#include <string>
#include <vector>

namespace bundle_icp {

/** One line of the benchmark's table: a method of reconstruction. */
struct Variant {
  std::string name;
  std::string description;
  void (*apply)(ReconstructionOptions& options);
};

/** The methods of the paper's Table 1, in its order. */
const std::vector<Variant>&
comparedMethods();

/** Bundle ICP without one of its parts. */
const std::vector<Variant>&
ablations();

} // namespace bundle_icp

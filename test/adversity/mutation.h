// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <random>
#include <string>

namespace adversity {

/** A damaged file. */
struct Mutant {
  std::string bytes;
  std::string change; ///< what was done, for messages
};

/** Damages a file in one way that the generator chooses: bits, bytes, its end; of text also its
 *  numbers and lines. The same generator gives the same mutant. */
Mutant
mutate(const std::string& bytes, bool is_text, std::mt19937& random);

} // namespace adversity

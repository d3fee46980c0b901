// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <sstream>
#include <string>

namespace bundle_icp {

/** Text and numbers as one message. */
template <typename... Parts>
std::string
concatenate(const Parts&... parts)
{
  std::ostringstream stream;
  (stream << ... << parts);
  return stream.str();
}

} // namespace bundle_icp

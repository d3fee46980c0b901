// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <cstdarg>
#include <cstdio>
#include <string>

namespace bundle_icp {

/** As std::printf() writes it. */
__attribute__((format(printf, 1, 2))) inline std::string
formatText(const char* text, ...)
{
  char buffer[512];
  va_list values;
  va_start(values, text);
  std::vsnprintf(buffer, sizeof buffer, text, values);
  va_end(values);
  return buffer;
}

} // namespace bundle_icp

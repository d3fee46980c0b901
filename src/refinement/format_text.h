// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <cstdarg>
#include <cstdio>
#include <locale.h> // POSIX: newlocale
#include <string>

namespace bundle_icp {

/** As std::printf() writes it where numbers have a decimal point, whatever the locale of the
 *  application; at most 511 characters. */
__attribute__((format(printf, 1, 2))) inline std::string
formatText(const char* text, ...)
{
  char buffer[512];
  static const locale_t with_point = newlocale(LC_ALL_MASK, "C", locale_t(0));
  const locale_t of_application = uselocale(with_point);
  va_list values;
  va_start(values, text);
  std::vsnprintf(buffer, sizeof buffer, text, values);
  va_end(values);
  uselocale(of_application);
  return buffer;
}

} // namespace bundle_icp

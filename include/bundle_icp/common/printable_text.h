// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/export.h>

#include <string>

namespace bundle_icp {

/** Text from a file or a path as a terminal and JSON can show it: bytes that are no UTF-8 and
 *  control characters other than the end of a line become `\xNN`. Messages of this library hold
 *  names as they are; programs that print them should use this. */
BUNDLE_ICP_EXPORT std::string
printable(const std::string& text);

} // namespace bundle_icp

// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/export.h>

#include <functional>
#include <string>

namespace bundle_icp {

/** Writes a file so that it appears whole or not at all: `write` is given the name of a
 *  temporary file in the same folder with the same extension, which is synchronised to
 * disk and then renamed. When `write` throws, or the disk is full, the temporary file
 * is removed, what was at `path` stays, and the error is passed on. \throws
 * pcl::IOException naming `path` and the reason. */
BUNDLE_ICP_EXPORT void
writeAtomically(const std::string& path,
                const std::function<void(const std::string& temporary_path)>& write);

} // namespace bundle_icp

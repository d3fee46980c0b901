// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/export.h>

#include <functional>
#include <string>

namespace bundle_icp {

/** Writes a file that appears whole or not at all: `write` gets the name of a temporary file in the
 *  same folder with the same extension. The temporary file is synchronised to disk and then renamed
 *  to `path`. When `write` throws or the disk is full, the temporary file is removed, an older file
 *  at `path` stays, and the error is passed on.
 *  \throws pcl::IOException naming `path` and the reason. */
BUNDLE_ICP_EXPORT void
writeAtomically(const std::string& path,
                const std::function<void(const std::string& temporary_path)>& write);

} // namespace bundle_icp

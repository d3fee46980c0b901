// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "simulation/scan_layouts.h"

namespace bundle_icp {

/** Writes a frame as an organized point cloud of PCL, its pose as the viewpoint. */
void
writePcd(const SyntheticScan& scan, const WrittenFrame& frame,
         const boost::filesystem::path& folder);

/** Writes a frame as a part of a .sens file, which joinSensParts() makes of all parts. */
void
writeSensPart(const SyntheticScan& scan, const WrittenFrame& frame,
              const boost::filesystem::path& folder);
void
joinSensParts(const SyntheticScan& scan, const boost::filesystem::path& folder);

} // namespace bundle_icp

// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "simulation/scan_layouts.h"

namespace bundle_icp {

/** Writes the confidence of depth: 2 is the highest, 0 the lowest. */
void
writeConfidence(const SyntheticScan& scan, const WrittenFrame& frame,
                const boost::filesystem::path& folder);

/** Writes camera and poses as Stray Scanner does. */
void
writeStrayScannerLists(const SyntheticScan& scan, const boost::filesystem::path& folder);

/** Writes the transforms.json of nerfstudio. */
void
writeTransforms(const SyntheticScan& scan, const boost::filesystem::path& folder);

/** Writes camera and pose of a frame as Polycam does. */
void
writePolycamCamera(const SyntheticScan& scan, const WrittenFrame& frame,
                   const boost::filesystem::path& folder);

} // namespace bundle_icp

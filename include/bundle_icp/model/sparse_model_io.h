// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/model/sparse_model.h>

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

namespace bundle_icp {

/** The points of a component as a cloud (world frame, metres), in the colours of the frames that
 *  see them. With `cameras`, each registered frame adds a red point at its camera centre. */
BUNDLE_ICP_EXPORT pcl::PointCloud<pcl::PointXYZRGB>::Ptr
toPointCloud(const ImageGraph& graph, const SparseModel& model, int component, bool cameras = true);

/** Writes the cloud of toPointCloud() as writeMesh() does. */
BUNDLE_ICP_EXPORT void
writeSparseModel(const std::string& path, const ImageGraph& graph, const SparseModel& model,
                 int component = 0);

} // namespace bundle_icp

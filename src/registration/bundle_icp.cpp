// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#define BUNDLE_ICP_BUNDLE_ICP_CPP_
#include <bundle_icp/registration/bundle_icp.h>

#include <pcl/impl/instantiate.hpp>

PCL_INSTANTIATE(BundleICP,
                (pcl::PointXYZ)(pcl::PointXYZRGB)(pcl::PointNormal)(pcl::PointXYZRGBNormal))

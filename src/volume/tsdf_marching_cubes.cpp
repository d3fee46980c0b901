// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#define BUNDLE_ICP_TSDF_MARCHING_CUBES_CPP_
#include <bundle_icp/volume/tsdf_marching_cubes.h>

#include <pcl/impl/instantiate.hpp>

PCL_INSTANTIATE(TSDFMarchingCubes, (pcl::PointNormal)(pcl::PointXYZRGBNormal))

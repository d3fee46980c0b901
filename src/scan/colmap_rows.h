// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "scan/database_rows.h"

#include <bundle_icp/common/camera_intrinsics.h>

/** Cameras and matches in the form of COLMAP's tables. */
namespace bundle_icp {

constexpr std::int64_t MAX_IMAGES = 2147483647; ///< of COLMAP's pair_id
constexpr int PINHOLE = 1;    ///< COLMAP's number of the camera model fx, fy, cx, cy
constexpr int CALIBRATED = 2; ///< COLMAP's number of a pair with an essential matrix
/** COLMAP's pixels have their centres at halves. */
constexpr float PIXEL_CENTRE = 0.5f;

inline std::int64_t
pairId(std::int64_t first, std::int64_t second)
{
  return std::min(first, second) * MAX_IMAGES + std::max(first, second);
}

/** The camera of the parameters of colmapMatrix(). */
inline CameraIntrinsics
toCamera(int width, int height, const Bytes& params)
{
  std::vector<double> values;
  take(params, values);
  values.resize(4);
  CameraIntrinsics camera;
  camera.width = width;
  camera.height = height;
  camera.fx = values[0];
  camera.fy = values[1];
  camera.cx = values[2] - PIXEL_CENTRE;
  camera.cy = values[3] - PIXEL_CENTRE;
  return camera;
}

/** COLMAP writes a match as two numbers of 32 bits, the image with the lower number first. */
inline Bytes
colmapMatches(const std::vector<FeatureMatch>& matches, bool is_swapped)
{
  std::vector<std::uint32_t> numbers;
  for (const FeatureMatch& match : matches) {
    numbers.push_back(std::uint32_t(is_swapped ? match.second : match.first));
    numbers.push_back(std::uint32_t(is_swapped ? match.first : match.second));
  }
  return bytesOf(numbers);
}

inline Bytes
rowMajor(const Eigen::Matrix3d& matrix)
{
  const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> rows = matrix;
  return bytesOf(rows.data(), 9);
}

inline Eigen::Matrix3d
colmapMatrix(const CameraIntrinsics& camera)
{
  Eigen::Matrix3d k = Eigen::Matrix3d::Identity();
  k(0, 0) = camera.fx;
  k(1, 1) = camera.fy;
  k(0, 2) = camera.cx + PIXEL_CENTRE;
  k(1, 2) = camera.cy + PIXEL_CENTRE;
  return k;
}

} // namespace bundle_icp

// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/io/rgbd_dataset.h>

#include "io/recordings/dataset_formats.h"

#include <boost/filesystem.hpp>
#include <pcl/exceptions.h>

#include <cmath>

namespace bundle_icp {

namespace fs = boost::filesystem;

namespace {

Recording
readFolder(const std::string& path, const DatasetOptions& options)
{
  if (isTumFolder(path))
    return readTumFolder(path, options);
  if (isSevenScenesFolder(path))
    return readSevenScenesFolder(path);
  if (isOpen3dFolder(path))
    return readOpen3dFolder(path, options);
  throw pcl::IOException(
      path + ": unknown format; expected TUM RGB-D (rgb.txt and depth.txt), 7-Scenes " +
      "(frame-000000.color.png, ...) or Open3D (color/, depth/, intrinsic.json)");
}

void
checkFolder(const std::string& path)
{
  boost::system::error_code code;
  const fs::file_status status = fs::status(path, code);
  if (!fs::exists(status))
    throw pcl::IOException(path + ": no such folder");
  if (!fs::is_directory(status))
    throw pcl::IOException(path + ": is not a folder");
  const bool is_empty = fs::is_empty(path, code);
  if (code)
    throw pcl::IOException(path + ": cannot be read: " + code.message());
  if (is_empty)
    throw pcl::IOException(path + ": the folder is empty");
}

} // namespace

bool
DatasetOptions::isValid(std::string* error) const
{
  const auto fail = [error](const std::string& reason) {
    if (error)
      *error = reason;
    return false;
  };
  if (stride == 0)
    return fail("stride must be at least 1");
  if (depth_scale && !(std::isfinite(*depth_scale) && *depth_scale > 0))
    return fail("depth scale " + std::to_string(*depth_scale) +
                " units per metre must be finite and positive");
  if (!(depth_factor > 0.5 && depth_factor < 2))
    return fail("depth factor " + std::to_string(depth_factor) + " must lie in (0.5, 2)");
  if (field_of_view && !(*field_of_view > 0.1 && *field_of_view < 2.8))
    return fail("field of view " + std::to_string(*field_of_view) + " rad must lie in (0.1, 2.8)");
  if (depth_noise && !depth_noise->isValid(error))
    return false;
  if (depth_camera && !isRigid(depth_camera->color_from_depth.matrix()))
    return fail("the pose of the depth camera must be a rigid motion");
  if (!(std::isfinite(max_time_difference) && max_time_difference > 0))
    return fail("largest time difference " + std::to_string(max_time_difference) +
                " s must be finite and positive");
  if (intrinsics && (intrinsics->width != 0 || intrinsics->height != 0))
    return intrinsics->isValid(error);
  return true;
}

RGBDDataset::Ptr
openDataset(const std::string& path, const DatasetOptions& options)
{
  std::string error;
  if (!options.isValid(&error))
    throw pcl::BadArgumentException("openDataset: " + error);
  try {
    checkFolder(path);
    return makeImageFileDataset(readFolder(path, options), path, options);
  }
  catch (const fs::filesystem_error& fault) {
    throw pcl::IOException(path + ": " + fault.what());
  }
}

} // namespace bundle_icp

// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/io/memory_dataset.h>

#include <bundle_icp/common/exceptions.h>

#include <opencv2/core.hpp>

#include <cmath>

namespace bundle_icp {
namespace {

std::string
sizeText(int width, int height)
{
  return std::to_string(width) + " x " + std::to_string(height);
}

void
checkImage(const char* kind, const cv::Mat& image, int type, const CameraIntrinsics& camera,
           const std::string& frame)
{
  if (image.empty() || image.type() != type)
    throw BadArgumentException("MemoryDataset: " + frame + ": the " + kind + " image is " +
                               (image.empty() ? "empty" : cv::typeToString(image.type())) +
                               "; it must be " + cv::typeToString(type));
  if (image.cols != camera.width || image.rows != camera.height)
    throw BadArgumentException("MemoryDataset: " + frame + ": the " + kind + " image has " +
                               sizeText(image.cols, image.rows) + " pixels, the camera " +
                               sizeText(camera.width, camera.height));
}

} // namespace

MemoryDataset::MemoryDataset(const CameraIntrinsics& camera) : camera_(camera)
{
  std::string error;
  if (!camera.isValid(&error))
    throw BadArgumentException("MemoryDataset: " + error);
  if (camera.hasDistortion())
    throw BadArgumentException("MemoryDataset: the camera has distortion; frames in memory must be "
                               "undistorted, and so their camera");
}

void
MemoryDataset::add(const RGBDFrame& frame)
{
  const std::string place = "frame " + std::to_string(frames_.size());
  checkImage("colour", frame.color, CV_8UC3, camera_, place);
  checkImage("depth", frame.depth, CV_32FC1, camera_, place);
  if (!std::isfinite(frame.timestamp))
    throw BadArgumentException("MemoryDataset: " + place + ": the time stamp is not finite");
  is_ordered_ = is_ordered_ && (frames_.empty() || frames_.back().timestamp < frame.timestamp);
  frames_.push_back({frames_.size(), frame.timestamp, frame.color.clone(), frame.depth.clone()});
}

std::size_t
MemoryDataset::size() const
{
  return frames_.size();
}

const CameraIntrinsics&
MemoryDataset::camera() const
{
  return camera_;
}

std::size_t
MemoryDataset::id(std::size_t index) const
{
  return frames_.at(index).id;
}

double
MemoryDataset::timestamp(std::size_t index) const
{
  return frames_.at(index).timestamp;
}

std::string
MemoryDataset::name(std::size_t index) const
{
  return "frame " + std::to_string(id(index));
}

RGBDFrame
MemoryDataset::read(std::size_t index) const
{
  return frames_.at(index);
}

bool
MemoryDataset::isOrdered() const
{
  return is_ordered_;
}

} // namespace bundle_icp

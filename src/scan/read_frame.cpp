// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/read_frame.h"

#include "io/text_file.h"

#include <bundle_icp/common/exceptions.h>

#include <new>

namespace bundle_icp {
namespace {

std::string
sizeOf(const cv::Mat& image)
{
  return std::to_string(image.cols) + "x" + std::to_string(image.rows);
}

/** What is wrong with a frame; empty when nothing is. */
std::string
faultOf(const RGBDFrame& frame, const CameraIntrinsics& camera)
{
  const cv::Size size(camera.width, camera.height);
  for (const cv::Mat* image : {&frame.color, &frame.depth})
    if (image->size() != size)
      return "an image of " + sizeOf(*image) + ", but the camera has " +
             std::to_string(camera.width) + "x" + std::to_string(camera.height);
  if (frame.color.type() != CV_8UC3)
    return "colour must have 8 bits in each of 3 channels (CV_8UC3)";
  if (frame.depth.type() != CV_32FC1)
    return "depth must be in metres in one channel of floats (CV_32FC1)";
  return "";
}

} // namespace

RGBDFrame
readFrame(const RGBDDataset& dataset, std::size_t index)
{
  const auto fail = [&](const std::string& reason) {
    throw IOException(dataset.name(index) + ": " + reason);
  };
  RGBDFrame frame;
  try {
    frame = dataset.read(index);
  }
  catch (const pcl::IOException&) { // names the file
    throw;
  }
  catch (const std::bad_alloc&) {
    fail("cannot be read: not enough memory");
  }
  catch (const std::exception& error) {
    fail("cannot be read: " + messageOf(error));
  }
  if (const std::string fault = faultOf(frame, dataset.camera()); !fault.empty())
    fail(fault);
  return frame;
}

} // namespace bundle_icp

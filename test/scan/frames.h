// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/reconstruction.h>
#include <bundle_icp/simulation/synthetic_scan.h>

#include <pcl/exceptions.h>

#include <algorithm>
#include <set>
#include <string>
#include <vector>

namespace bundle_icp::test {

inline const SyntheticScan&
room()
{
  static const SyntheticScan scan = [] {
    SyntheticScanOptions options;
    options.num_frames = 40;
    options.width = 320;
    options.height = 240;
    options.focal_length = 262.5;
    return SyntheticScan(options);
  }();
  return scan;
}

/** Some frames of the room in any order; bad ones cannot be read. */
class Frames : public RGBDDataset {
public:
  explicit Frames(std::vector<std::size_t> frames, std::set<std::size_t> bad = {})
  : frames_(std::move(frames)), bad_(std::move(bad))
  {
    for (const std::size_t i : frames_)
      images_.push_back(image(i));
  }

  std::size_t
  size() const override
  {
    return frames_.size();
  }
  const CameraIntrinsics&
  camera() const override
  {
    return room().camera();
  }
  std::size_t
  id(std::size_t index) const override
  {
    return frames_[index];
  }
  double
  timestamp(std::size_t index) const override
  {
    return room().timestamp(frames_[index]);
  }
  std::string
  name(std::size_t index) const override
  {
    return "frame " + std::to_string(frames_[index]);
  }
  RGBDFrame
  read(std::size_t index) const override
  {
    if (bad_.count(frames_[index]))
      throw pcl::IOException(name(index) + ".png is truncated");
    return images_[index];
  }

private:
  static const RGBDFrame&
  image(std::size_t frame)
  {
    static std::vector<RGBDFrame> rendered(room().size());
    if (rendered[frame].color.empty())
      rendered[frame] = room().read(frame);
    return rendered[frame];
  }

  std::vector<std::size_t> frames_;
  std::set<std::size_t> bad_;
  std::vector<RGBDFrame> images_;
};

inline std::vector<std::size_t>
everyFourth()
{
  return {0, 4, 8, 12, 16, 20, 24, 28};
}

inline ReconstructionOptions
withoutMesh()
{
  ReconstructionOptions options;
  options.make_mesh = false;
  return options;
}

/** Of everyFourth() frame, computed once per program. */
inline const ReconstructionResult&
reference()
{
  static const ReconstructionResult result = reconstruct(Frames(everyFourth()), withoutMesh());
  return result;
}

/** Largest distance of the frames' positions from the truth; the world is the camera of
 * the first frame. */
inline double
largestError(const ReconstructionResult& result)
{
  double largest = 0;
  const Pose first = room().worldFromCamera(result.frames.front().id).inverse();
  for (const FrameReport& frame : result.frames)
    if (frame.registered)
      largest = std::max(largest, (frame.world_from_camera.translation() -
                                   (first * room().worldFromCamera(frame.id)).translation())
                                      .norm());
  return largest;
}

} // namespace bundle_icp::test

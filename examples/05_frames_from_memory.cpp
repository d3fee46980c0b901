// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
//
// Frames of one's own, as a camera's driver gives them: a dataset that lives in memory.
#include <bundle_icp/reconstruction.h>
#include <bundle_icp/simulation/synthetic_scan.h>

#include <exception>
#include <iostream>

namespace {

class FramesInMemory : public bundle_icp::RGBDDataset {
public:
  FramesInMemory(const bundle_icp::CameraIntrinsics& camera,
                 std::vector<bundle_icp::RGBDFrame> frames)
  : camera_(camera), frames_(std::move(frames))
  {
  }

  std::size_t
  size() const override
  {
    return frames_.size();
  }

  const bundle_icp::CameraIntrinsics&
  camera() const override
  {
    return camera_;
  }

  std::size_t
  id(std::size_t index) const override
  {
    return frames_[index].id;
  }

  double
  timestamp(std::size_t index) const override
  {
    return frames_[index].timestamp;
  }

  std::string
  name(std::size_t index) const override
  {
    return "frame " + std::to_string(frames_[index].id);
  }

  bundle_icp::RGBDFrame
  read(std::size_t index) const override
  {
    return frames_[index];
  }

private:
  bundle_icp::CameraIntrinsics camera_;
  std::vector<bundle_icp::RGBDFrame> frames_;
};

/** Stands for a camera. */
FramesInMemory
recordSomething()
{
  bundle_icp::SyntheticScanOptions options;
  options.num_frames = 10;
  const bundle_icp::SyntheticScan scan(options);
  std::vector<bundle_icp::RGBDFrame> frames;
  for (std::size_t i = 0; i < scan.size(); ++i)
    frames.push_back(scan.read(i));
  return {scan.camera(), frames};
}

} // namespace

int
main()
{
  try {
    const FramesInMemory frames = recordSomething();
    const bundle_icp::ReconstructionResult result = bundle_icp::reconstruct(frames);
    std::cout << result.summary() << '\n';
  }
  catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
  return 0;
}

// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// What applications do wrong: the library says so, and the application goes on.
#include "messages.h"
#include "scan/frames.h"
#include "temporary_folder.h"

#include <nlohmann/json.hpp>

#include <new>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

/** Frames one of which is read in a way of its own. */
class OddFrames : public Frames {
public:
  using Fault = std::function<RGBDFrame(RGBDFrame)>;

  explicit OddFrames(Fault fault) : Frames(everyFourth()), fault_(std::move(fault)) {}

  std::string
  name(std::size_t index) const override
  {
    return index == 2 ? "frame \xff" : Frames::name(index);
  }

  RGBDFrame
  read(std::size_t index) const override
  {
    return index == 2 ? fault_(Frames::read(index)) : Frames::read(index);
  }

private:
  Fault fault_;
};

class DistortedFrames : public Frames {
public:
  DistortedFrames() : Frames({0, 4}), camera_(Frames::camera()) { camera_.k1 = 0.1; }

  const CameraIntrinsics&
  camera() const override
  {
    return camera_;
  }

  RGBDFrame
  read(std::size_t) const override
  {
    throw std::logic_error("no frame is read");
  }

private:
  CameraIntrinsics camera_;
};

} // namespace

TEST(Misuse, AnyFaultOfReadIsThatFramesReason)
{
  const std::pair<OddFrames::Fault, const char*> faults[] = {
      {[](RGBDFrame) -> RGBDFrame { throw std::bad_alloc(); }, "not enough memory"},
      {[](RGBDFrame) -> RGBDFrame { throw std::runtime_error("the plug fell out"); },
       "the plug fell out"},
      {[](RGBDFrame) { return RGBDFrame(); }, "an image of 0x0, but the camera has 320x240"},
      {[](RGBDFrame frame) {
         frame.depth = frame.depth.rowRange(0, 100);
         return frame;
       },
       "an image of 320x100"},
      {[](RGBDFrame frame) {
         frame.depth.convertTo(frame.depth, CV_16U, 1000);
         return frame;
       },
       "CV_32FC1"},
      {[](RGBDFrame frame) {
         frame.color.convertTo(frame.color, CV_16U);
         return frame;
       },
       "CV_8UC3"}};
  for (const auto& [fault, reason] : faults) {
    const ReconstructionResult result = reconstruct(OddFrames(fault), withoutMesh());
    EXPECT_EQ(result.component_sizes, std::vector<std::size_t>{7}) << reason;
    EXPECT_FALSE(result.frames[2].registered);
    EXPECT_CONTAINS(result.frames[2].reason, reason);
    EXPECT_CONTAINS(result.frames[2].reason, "frame \xff");
  }
}

TEST(Misuse, BytesThatAreNoTextReachTheReportEscaped)
{
  const OddFrames frames([](RGBDFrame) { return RGBDFrame(); });
  const ReconstructionResult result = reconstruct(frames, withoutMesh());
  const TemporaryFolder folder;
  writeReconstruction(folder.path("\xfe"), frames, withoutMesh(), result);
  const auto report = nlohmann::json::parse(readText(folder.path("\xfe/report.json")));
  EXPECT_EQ(report["frames"][2]["name"], "frame \\xff");
  EXPECT_CONTAINS(report["frames"][2]["reason"].get<std::string>(), "frame \\xff");
}

TEST(Misuse, AnExceptionOfTheProgressCallbackReachesTheCaller)
{
  for (const std::string stage : {"features", "matching", "registration", "surface"}) {
    ReconstructionOptions options;
    options.volume.voxel_size = 0.02;
    options.volume.truncation = 0.08;
    options.num_threads = 2;
    EXPECT_EQ(messageOf<std::runtime_error>([&] {
                reconstruct(Frames({0, 4, 8, 12}), options, [&](const Progress& progress) -> bool {
                  if (progress.stage == stage)
                    throw std::runtime_error("window closed");
                  return true;
                });
              }),
              "window closed")
        << stage;
  }
}

TEST(Misuse, ACameraWithDistortionIsRefusedAtOnce)
{
  EXPECT_CONTAINS(
      messageOf<pcl::BadArgumentException>([] { reconstruct(DistortedFrames(), withoutMesh()); }),
      "the camera of the frames has distortion");
}

TEST(Misuse, MoreThreadsThanTheMachineStarts)
{
  ReconstructionOptions options = withoutMesh();
  options.num_threads = 100000;
  EXPECT_EQ(reconstruct(Frames({0, 4}), options).component_sizes, std::vector<std::size_t>{2});
}

// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "common/parallel.h"
#include "messages.h"
#include "scan/depth_view_store.h"
#include "scan/frames.h"
#include "temporary_folder.h"

#include <opencv2/core.hpp>

#include <limits>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

constexpr std::size_t LEAST = std::size_t(1) << 20;

/** With a coarse mesh, and images that are retrieved. */
ReconstructionOptions
smallScan()
{
  ReconstructionOptions options;
  options.volume.voxel_size = 0.03;
  options.volume.truncation = 0.09;
  options.graph.exhaustive_limit = 4;
  return options;
}

void
expectSame(const ReconstructionResult& a, const ReconstructionResult& b)
{
  ASSERT_EQ(a.frames.size(), b.frames.size());
  for (std::size_t i = 0; i < a.frames.size(); ++i) {
    EXPECT_EQ(a.frames[i].registered, b.frames[i].registered);
    EXPECT_EQ(a.frames[i].world_from_camera.matrix(), b.frames[i].world_from_camera.matrix());
    EXPECT_EQ(a.frames[i].covariance, b.frames[i].covariance);
    EXPECT_EQ(a.frames[i].depth_agreement, b.frames[i].depth_agreement);
  }
  EXPECT_EQ(a.model.calibration().values, b.model.calibration().values);
  ASSERT_EQ(a.model.points().size(), b.model.points().size());
  for (std::size_t i = 0; i < a.model.points().size(); ++i)
    EXPECT_EQ(a.model.points()[i].position, b.model.points()[i].position);
  EXPECT_EQ(a.mesh.cloud.data, b.mesh.cloud.data);
  EXPECT_GT(a.mesh.polygons.size(), 100u);
  EXPECT_EQ(a.mesh.polygons.size(), b.mesh.polygons.size());
}

} // namespace

TEST(BoundedMemory, GivesTheSameResultWithAnyNumberOfThreads)
{
  const Frames frames(everyFourth());
  const ReconstructionResult expected = reconstruct(frames, smallScan());
  EXPECT_EQ(expected.component_sizes, std::vector<std::size_t>{8});
  const TemporaryFolder folder;
  for (const int threads : {1, 4}) {
    ReconstructionOptions options = smallScan();
    options.max_memory = LEAST;
    options.temporary_folder = folder.path();
    options.num_threads = threads;
    expectSame(expected, reconstruct(frames, options));
  }
  EXPECT_TRUE(boost::filesystem::is_empty(folder.path()));
}

TEST(BoundedMemory, ServesTrackingAsWell)
{
  ReconstructionOptions options = withoutMesh();
  options.method = ReconstructionMethod::VISUAL_ICP;
  const Frames frames({0, 1, 2, 3, 4, 5});
  const ReconstructionResult expected = reconstruct(frames, options);
  options.max_memory = LEAST;
  const ReconstructionResult result = reconstruct(frames, options);
  ASSERT_EQ(expected.frames.size(), result.frames.size());
  for (std::size_t i = 0; i < result.frames.size(); ++i) {
    EXPECT_TRUE(result.frames[i].registered);
    EXPECT_EQ(expected.frames[i].world_from_camera.matrix(),
              result.frames[i].world_from_camera.matrix());
  }
}

TEST(BoundedMemory, NeedsTheFolderOnlyWhereMemoryIsTooSmall)
{
  const Frames frames({0, 4, 8});
  ReconstructionOptions options = withoutMesh();
  options.temporary_folder = TemporaryFolder().path("missing");
  EXPECT_EQ(reconstruct(frames, options).status, ReconstructionStatus::COMPLETED);
  options.max_memory = LEAST;
  EXPECT_CONTAINS(messageOf<pcl::IOException>([&] { reconstruct(frames, options); }),
                  options.temporary_folder + ": what does not fit in memory");
}

TEST(BoundedMemory, RefusesLessThanAFrameTakes)
{
  ReconstructionOptions options;
  options.max_memory = LEAST - 1;
  EXPECT_CONTAINS(messageOf<pcl::BadArgumentException>([&] {
                    reconstruct(Frames({0, 4}), options);
                  }),
                  "max_memory must be 0 or at least 1048576 bytes");
}

TEST(BoundedMemory, SaysThatTheSurfaceTakesMore)
{
  ReconstructionOptions options = smallScan();
  const Frames frames({0, 4, 8});
  const auto says_so = [&] {
    const ReconstructionResult result = reconstruct(frames, options);
    EXPECT_FALSE(result.mesh.polygons.empty());
    return std::count_if(result.findings.begin(), result.findings.end(),
                         [](const Finding& finding) {
                           return finding.kind == "memory" && finding.severity == Severity::NOTE;
                         }) == 1;
  };
  EXPECT_FALSE(says_so());
  options.max_memory = LEAST;
  EXPECT_TRUE(says_so());
  options.max_memory = std::size_t(1) << 30;
  EXPECT_FALSE(says_so());
}

TEST(DepthViewStore, KeepsToItsMemoryAndGivesTheSameViews)
{
  const TemporaryFolder folder;
  const CameraIntrinsics& camera = room().camera();
  constexpr std::size_t count = 40, bytes = 5000000, no_limit = std::size_t(1) << 30;
  DepthViewStore bounded(camera, 2, {}, bytes, folder.path()), free(camera, 2, {}, no_limit, "");
  for (DepthViewStore* store : {&bounded, &free}) {
    store->resize(count);
    parallelFor(count, 4, {}, [&](std::size_t i) { store->set(i, room().read(i % 10).depth); });
    EXPECT_GT(store->bytesInMemory(), 0u);
  }
  EXPECT_LE(bounded.bytesInMemory(), bytes);
  parallelFor(4 * count, 4, {}, [&](std::size_t k) {
    const std::size_t i = 7 * k % count;
    const auto a = bounded.get(i, {}, DepthError::Zero()), b = free.get(i, {}, DepthError::Zero());
    for (const auto& [image, expected] :
         {std::pair(&a->depth, &b->depth), std::pair(&a->weight, &b->weight)}) {
      const cv::Mat differs = (*image != *expected) & (*image == *image);
      EXPECT_EQ(cv::countNonZero(differs), 0);
      EXPECT_EQ(cv::countNonZero(*image == *image), cv::countNonZero(*expected == *expected));
    }
  });
  EXPECT_LE(bounded.bytesInMemory(), bytes);
  EXPECT_GT(free.bytesInMemory(), bytes);
}

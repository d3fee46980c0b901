// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// A scan whose depth is not registered is reconstructed as well as one whose depth is.
#include <bundle_icp/evaluation/surface_error.h>
#include <bundle_icp/evaluation/trajectory_error.h>
#include <bundle_icp/reconstruction.h>
#include <bundle_icp/simulation/synthetic_scan.h>

#include "noisy_scan.h"
#include "temporary_folder.h"

#include <gtest/gtest.h>

using namespace bundle_icp;

namespace {

SyntheticScanOptions
sharpScan()
{
  SyntheticScanOptions options = test::noisyScan(16, 262.5);
  options.blur_fraction = 0;
  options.seed = 3;
  return options;
}

struct Errors {
  double trajectory = 0, surface = 0; ///< [m]
};

/** Errors of what is reconstructed from the files of a scan. */
Errors
errorsOf(const SyntheticScanOptions& options)
{
  const SyntheticScan scan(options);
  const TemporaryFolder folder;
  SyntheticScanWriteOptions write;
  write.surface_spacing = 0;
  writeSyntheticScan(scan, folder.path("scan"), write);
  const ReconstructionResult result = reconstruct(*openDataset(folder.path("scan")));
  EXPECT_EQ(result.trajectory().size(), scan.size());
  EXPECT_EQ(result.verdict(), Verdict::GOOD);
  const auto error = absoluteTrajectoryError(scan.groundTruth(), result.trajectory());
  if (!error) {
    ADD_FAILURE() << "no trajectory";
    return {};
  }
  SurfaceErrorOptions surface;
  surface.truth_from_estimate = error->truth_from_estimate;
  surface.distance_to_truth = [&scan](const Eigen::Vector3d& x) {
    return scan.distanceToSurface(x);
  };
  const SurfaceError mesh = surfaceError(result.mesh, *scan.visibleSurface(0.01), surface);
  return {error->translation.rmse, mesh.accuracy.rmse};
}

} // namespace

TEST(DepthCamera, BesideTheColourCameraIsAsGoodAsRegisteredDepth)
{
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "too slow with sanitizers";
#endif
  SyntheticScanOptions options = sharpScan();
  const Errors registered = errorsOf(options);
  options.depth_offset = {0.03, 0.002, 0};
  options.depth_focal_length = 285;
  const Errors moved = errorsOf(options);
  RecordProperty("registered_ate_um", int(1e6 * registered.trajectory));
  RecordProperty("moved_ate_um", int(1e6 * moved.trajectory));
  EXPECT_LT(moved.trajectory, 1.3 * registered.trajectory);
  EXPECT_LT(moved.surface, 1.3 * registered.surface);
}

// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "common/parallel.h"
#include "registration/frame_registrar.h"

#include "noisy_scan.h"
#include "scenes.h"

#include <bundle_icp/simulation/synthetic_scan.h>

#include <Eigen/Dense>
#include <gtest/gtest.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

/** Errors of registered poses, against what their covariances promise. */
struct PoseStatistics {
  double squared_error = 0; ///< normalised, a degree of freedom
  double squared_distance = 0;
  std::size_t count = 0;

  void
  add(const FrameRegistration& registration, const Pose& truth)
  {
    if (!registration.registered)
      return;
    Pose turn = Pose::Identity();
    turn.linear() = registration.world_from_camera.linear() * truth.linear().transpose();
    Vector6d error = logarithm(turn);
    error.tail<3>() = registration.world_from_camera.translation() - truth.translation();
    squared_error += error.dot(registration.covariance.ldlt().solve(error)) / 6;
    squared_distance += error.tail<3>().squaredNorm();
    ++count;
  }

  double
  consistency() const
  {
    return squared_error / double(count);
  }

  double
  rms() const
  {
    return std::sqrt(squared_distance / double(count));
  }
};

struct Evidence {
  PoseStatistics visual, dense, both;
};

/** Frames of a scan with all of a camera's faults, every other one registered at its true pose and
 *  the rest against these. */
void
registerScan(double texture, double start_time, std::uint64_t seed, Evidence& evidence)
{
  SyntheticScanOptions scene = noisyScan(80, 262.5);
  scene.texture = texture;
  scene.start_time = start_time;
  scene.seed = seed;
  const SyntheticScan scan(scene);
  std::vector<ImageNode> nodes(scan.size());
  std::vector<std::shared_ptr<const DepthView>> views(scan.size());
  parallelFor(scan.size(), 0, {}, [&](std::size_t i) {
    const RGBDFrame frame = scan.read(i);
    nodes[i].features = extractFeatures(frame, scan.camera());
    nodes[i].timestamp = scan.timestamp(i);
    views[i] = std::make_shared<const DepthView>(makeDepthView(frame.depth, scan.camera(), 2));
  });
  ImageGraph graph(scan.camera());
  graph.append(nodes, true);
  const FrameRegistrationOptions options;
  const BundleAdjustmentOptions adjustment;
  const DepthViewProvider provider = [&](std::size_t frame, const SparseModel&) {
    return views[frame];
  };
  FrameRegistrar registrar(graph, provider, options, adjustment);
  registrar.setDepthErrors(false); // the simulated camera has none
  SparseModel model(scan.size());
  for (std::size_t i = 1; i < scan.size(); i += 2)
    model.registerFrame(graph, i, scan.worldFromCamera(i), 0, TrackOptions());
  struct Registrations {
    FrameRegistration visual, dense, both;
  };
  std::vector<Registrations> found(scan.size());
  parallelFor(scan.size() / 2 - 1, 0, {}, [&](std::size_t k) {
    const std::size_t i = 2 * k + 2;
    const NewFrame frame = registrar.newFrame(model, i, 0, 1);
    if (!frame.neighbours.empty()) {
      found[i].visual = registrar.registerVisually(model, frame);
      found[i].both = registrar.bundleICP(model, frame);
    }
    const Pose guess = randomMotion(unsigned(i), 0.01, 0.01) * scan.worldFromCamera(i);
    found[i].dense = registrar.bundleICP(model, {i, {{i - 1, 0}, {i + 1, 0}}, guess, 1});
  });
  for (std::size_t i = 2; i + 1 < scan.size(); i += 2) {
    evidence.visual.add(found[i].visual, scan.worldFromCamera(i));
    evidence.dense.add(found[i].dense, scan.worldFromCamera(i));
    evidence.both.add(found[i].both, scan.worldFromCamera(i));
  }
}

/** Covariances that are true have a consistency of 1; of these bounds the factor is that by which
 *  errors may be 1.4 times smaller or larger. */
void
expectTrueCovariances(const PoseStatistics& statistics, const char* name)
{
  std::cout << name << ": " << statistics.count << " poses, consistency "
            << statistics.consistency() << ", position " << 1000 * statistics.rms() << " mm\n";
  EXPECT_GT(statistics.consistency(), 0.5) << name;
  EXPECT_LT(statistics.consistency(), 2.0) << name;
}

} // namespace

TEST(RegisteredPoses, AreAsExactAsTheirCovariancesSayAndBetterWithVirtualDepth)
{
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "takes minutes under sanitizers; other tests run the same code";
#endif
  Evidence textured, bare, walls;
  for (const std::uint64_t seed : {0, 1}) {
    registerScan(1, 0, seed, textured);
    registerScan(0, 0, seed, bare);
    registerScan(1, 67, seed, walls);
    registerScan(0.1, 67, seed, walls);
  }
  const auto all = [&](PoseStatistics Evidence::*kind) {
    PoseStatistics sum;
    for (const Evidence* part : {&textured, &bare, &walls}) {
      sum.squared_error += (part->*kind).squared_error;
      sum.squared_distance += (part->*kind).squared_distance;
      sum.count += (part->*kind).count;
    }
    return sum;
  };
  expectTrueCovariances(all(&Evidence::visual), "visual evidence");
  expectTrueCovariances(all(&Evidence::dense), "virtual depth");
  expectTrueCovariances(all(&Evidence::both), "both");
  EXPECT_GE(all(&Evidence::both).count, 300u);

  // Shape without texture: few features, at edges. Virtual depth must win by far there.
  EXPECT_LT(bare.both.rms(), 0.3 * bare.visual.rms());
  EXPECT_LT(textured.both.rms(), 0.7 * textured.visual.rms());
  EXPECT_GE(bare.both.count, bare.visual.count);
}

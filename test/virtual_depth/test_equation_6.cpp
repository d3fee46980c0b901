// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
//
// Equation (6) as it is written, one pixel after another, beside what renders rows of
// them.
#include "registration/scenes.h"
#include "variants.h"

#include "common/depth_edges.h"
#include "virtual_depth/merge_views.h"

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

constexpr std::array<unsigned, 4> FRAMES{0, 4, 8, 12};

Pose
virtualFromView(unsigned frame)
{
  return room().worldFromCamera(6).inverse() * room().worldFromCamera(frame);
}

/** D(X_w^i) = proj(T_w^new X_w^i) for all X_w between the pixels of a view, two
 * triangles for each four pixels of one surface; 0 = nothing. */
cv::Mat
renderTriangles(const DepthView& view, const Pose& virtual_from_view)
{
  const CameraIntrinsics& camera = room().camera();
  const DepthEdges linked(view.camera);
  cv::Mat D(camera.height, camera.width, CV_64F, cv::Scalar(0));
  const auto render = [&](const Eigen::Matrix3d& corners) { // columns u, v, 1/D
    const Eigen::Array3d low = corners.rowwise().minCoeff(), high = corners.rowwise().maxCoeff();
    Eigen::Matrix3d affine = corners;
    affine.row(2).setOnes();
    for (int v = std::max(0, int(std::ceil(low[1]))); v <= high[1] && v < camera.height; ++v)
      for (int u = std::max(0, int(std::ceil(low[0]))); u <= high[0] && u < camera.width; ++u) {
        const Eigen::Vector3d share = affine.inverse() * Eigen::Vector3d(u, v, 1);
        const double depth = 1 / corners.row(2).dot(share);
        double& nearest = D.at<double>(v, u);
        if (share.minCoeff() >= 0 && affine.determinant() > 0 && (nearest == 0 || depth < nearest))
          nearest = depth;
      }
  };
  for (int v = 0; v + 1 < view.depth.rows; ++v)
    for (int u = 0; u + 1 < view.depth.cols; ++u) {
      Eigen::Matrix<double, 3, 4> corners;
      float z[4];
      bool whole = true;
      for (int i = 0; i < 4; ++i) {
        const int column = u + i % 2, row = v + i / 2;
        z[i] = view.depth.at<float>(row, column);
        whole = whole && view.weight.at<float>(row, column) > 0;
        const Eigen::Vector3d X = virtual_from_view * view.camera.unproject(column, row, z[i]);
        corners.col(i) << camera.fx * X.x() / X.z() + camera.cx,
            camera.fy * X.y() / X.z() + camera.cy, 1 / X.z();
      }
      if (whole &&
          linked(z[0], z[1]) + linked(z[2], z[3]) + linked(z[0], z[2]) + linked(z[1], z[3]) == 4) {
        render((Eigen::Matrix3d() << corners.col(0), corners.col(1), corners.col(2)).finished());
        render((Eigen::Matrix3d() << corners.col(1), corners.col(3), corners.col(2)).finished());
      }
    }
  return D;
}

} // namespace

TEST(Equation6, EachViewIsProjectedAsItIsWritten)
{
  for (const unsigned frame : FRAMES) {
    const DepthView view = makeDepthView(room().read(frame).depth, room().camera());
    const cv::Mat expected = renderTriangles(view, virtualFromView(frame));
    forEachVariant([&] {
      const WarpedView warped = warpView(view, room().camera(), virtualFromView(frame), {});
      std::size_t both = 0, equal = 0, shown = 0;
      for (std::size_t i = 0; i < warped.size(); ++i) {
        const double D = expected.ptr<double>()[i], inverse = double(warped[i].inverse_depth);
        shown += D > 0;
        both += D > 0 && inverse > 0;
        equal += D > 0 && std::abs(inverse * D - 1) < 2e-4;
      }
      EXPECT_GT(shown, warped.size() / 2);
      EXPECT_EQ(both, shown);
      EXPECT_GT(double(equal), 0.99 * double(both)); // else at edges
    });
  }
}

TEST(Equation6, RowsHoldTheSumOfEachPixel)
{
  const CameraIntrinsics& camera = room().camera();
  const VirtualDepthOptions options;
  std::vector<DepthView> views;
  for (const unsigned frame : FRAMES)
    views.push_back(makeDepthView(noisy(room().read(frame).depth, frame), camera));
  std::vector<Contribution> contributions;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const Pose pose = virtualFromView(FRAMES[i]);
    contributions.push_back({&views[i], warpView(views[i], camera, pose, options),
                             pose.linear().cast<float>(), pose.translation().cast<float>()});
  }
  const DepthSigma reach(camera.depth_noise, options.merge_sigmas * std::sqrt(2.0));
  forEachVariant([&] {
    VirtualDepth out = renderVirtualDepth({}, camera, Pose::Identity());
    mergeViews(contributions, options, out);
    std::size_t seen = 0, equal = 0;
    for (int v = 0; v < camera.height; ++v)
      for (int u = 0; u < camera.width; ++u) {
        std::vector<ViewTerm> terms;
        for (const Contribution& from : contributions)
          terms.push_back(viewTerm(from, camera, u, v));
        const ViewTerm expected = virtualDepthAt(terms, reach);
        const float D = out.depth.at<float>(v, u), variance = out.variance.at<float>(v, u);
        const cv::Vec3f n = out.normals.at<cv::Vec3f>(v, u);
        if (!(expected.w > 0)) {
          EXPECT_TRUE(std::isnan(D));
          continue;
        }
        ++seen;
        equal += std::abs(D - expected.D) < 1e-6f * D &&
                 std::abs(variance * expected.w - 1) < 1e-4f &&
                 (Eigen::Vector3f(n[0], n[1], n[2]) - expected.normal.normalized()).norm() < 1e-4f;
      }
    EXPECT_GT(seen, out.depth.total() * 9 / 10);
    EXPECT_GE(equal + 3,
              seen); // rounding decides whether a view just shows the nearest surface
  });
}

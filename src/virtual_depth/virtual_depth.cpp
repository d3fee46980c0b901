// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/virtual_depth/virtual_depth.h>

#include "common/parallel.h"
#include "virtual_depth/merge_views.h"

#include <bundle_icp/common/exceptions.h>

#include <cmath>
#include <limits>

namespace bundle_icp {
namespace {

constexpr float NOT_SEEN = std::numeric_limits<float>::quiet_NaN();
void
checkViews(const std::vector<RegisteredView>& views)
{
  for (std::size_t i = 0; i < views.size(); ++i) {
    const std::string name = "renderVirtualDepth: view " + std::to_string(i);
    const DepthView* view = views[i].view;
    if (!view)
      throw BadArgumentException(name + " is a null pointer");
    const cv::Size size(view->camera.width, view->camera.height);
    if (view->depth.type() != CV_32FC1 || view->normals.type() != CV_32FC3 ||
        view->weight.type() != CV_32FC1 || view->depth.size() != size ||
        view->normals.size() != size || view->weight.size() != size ||
        !view->depth.isContinuous() || !view->normals.isContinuous() ||
        !view->weight.isContinuous())
      throw BadArgumentException(name + " does not come from makeDepthView: type or "
                                        "size of its images do not fit its camera");
    if (!isRigid(views[i].world_from_camera.matrix()))
      throw BadArgumentException(name + " has a pose that is not a rigid motion");
  }
}

std::vector<Contribution>
warpViews(const std::vector<RegisteredView>& views, const VirtualDepth& out,
          const VirtualDepthOptions& options)
{
  std::vector<Contribution> contributions(views.size());
  const Pose virtual_from_world = out.world_from_camera.inverse();
#pragma omp parallel for num_threads(resolveThreads(options.num_threads)) schedule(dynamic, 1)
  for (std::size_t i = 0; i < views.size(); ++i) {
    const Pose virtual_from_view = virtual_from_world * views[i].world_from_camera;
    contributions[i] = {
        views[i].view, warpView(*views[i].view, out.camera, virtual_from_view, options),
        virtual_from_view.linear().cast<float>(), virtual_from_view.translation().cast<float>()};
  }
  return contributions;
}

/** Organized cloud of a depth image; `sigma(v, u)` gives the standard deviation. */
template <typename Sigma>
pcl::PointCloud<pcl::PointXYZRGBNormal>::Ptr
organizedCloud(const cv::Mat& depth, const cv::Mat& normals, const CameraIntrinsics& camera,
               const Pose& target_from_camera, const Sigma& sigma)
{
  pcl::PointCloud<pcl::PointXYZRGBNormal>::Ptr cloud(
      new pcl::PointCloud<pcl::PointXYZRGBNormal>(depth.cols, depth.rows));
  cloud->is_dense = false;
  const Eigen::Matrix3f rotation = target_from_camera.linear().cast<float>();
  const Eigen::Vector3f position = target_from_camera.translation().cast<float>();
  const Eigen::Vector3f along_u = rotation.col(0) / float(camera.fx);
  for (int v = 0; v < depth.rows; ++v) {
    const Eigen::Vector3f first =
        (target_from_camera.linear() * camera.unproject(0, v, 1)).cast<float>();
    const float* const z = depth.ptr<float>(v);
    const cv::Vec3f* const n = normals.ptr<cv::Vec3f>(v);
    pcl::PointXYZRGBNormal* const row = &(*cloud)[std::size_t(v) * std::size_t(depth.cols)];
    for (int u = 0; u < depth.cols; ++u) {
      pcl::PointXYZRGBNormal& point = row[u];
      if (z[u] > 0) {
        point.getVector3fMap() = z[u] * (first + float(u) * along_u) + position;
        point.getNormalVector3fMap() = rotation * Eigen::Vector3f(n[u][0], n[u][1], n[u][2]);
        point.curvature = sigma(v, u);
      }
      else {
        point.getVector3fMap().setConstant(NOT_SEEN);
        point.getNormalVector3fMap().setConstant(NOT_SEEN);
        point.curvature = NOT_SEEN;
      }
    }
  }
  return cloud;
}

} // namespace

bool
VirtualDepthOptions::isValid(std::string* error) const
{
  const auto fail = [error](const char* reason) {
    if (error)
      *error = reason;
    return false;
  };
  if (!(edge_distance >= 0) || !std::isfinite(edge_distance))
    return fail("edge_distance must be at least 0 px");
  if (!(max_view_angle > 0 && max_view_angle < 90))
    return fail("max_view_angle must lie between 0 and 90 degrees");
  if (!(merge_sigmas > 0) || !std::isfinite(merge_sigmas))
    return fail("merge_sigmas must be positive");
  if (num_threads < 0)
    return fail("num_threads must be at least 0");
  return true;
}

VirtualDepth
renderVirtualDepth(const std::vector<RegisteredView>& views, const CameraIntrinsics& camera,
                   const Pose& world_from_virtual, const VirtualDepthOptions& options)
{
  std::string error;
  if (!options.isValid(&error) || !camera.isValid(&error))
    throw BadArgumentException("renderVirtualDepth: " + error);
  if (!isRigid(world_from_virtual.matrix()))
    throw BadArgumentException("renderVirtualDepth: the virtual pose is not a rigid motion");
  checkViews(views);
  VirtualDepth out;
  out.camera = camera.undistorted();
  out.world_from_camera = world_from_virtual;
  const cv::Size size(camera.width, camera.height);
  out.depth.create(size, CV_32FC1);
  out.normals.create(size, CV_32FC3);
  out.variance.create(size, CV_32FC1);
  mergeViews(warpViews(views, out, options), options, out);
  return out;
}

pcl::PointCloud<pcl::PointXYZRGBNormal>::Ptr
toPointCloud(const VirtualDepth& virtual_depth)
{
  return organizedCloud(virtual_depth.depth, virtual_depth.normals, virtual_depth.camera,
                        virtual_depth.world_from_camera, [&](int v, int u) {
                          return std::sqrt(virtual_depth.variance.at<float>(v, u));
                        });
}

pcl::PointCloud<pcl::PointXYZRGBNormal>::Ptr
toPointCloud(const DepthView& view)
{
  return organizedCloud(view.depth, view.normals, view.camera, Pose::Identity(), [&](int v, int u) {
    const float weight = view.weight.at<float>(v, u);
    return weight > 0 ? 1 / std::sqrt(weight) : NOT_SEEN;
  });
}

} // namespace bundle_icp

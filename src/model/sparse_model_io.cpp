// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/io/mesh_io.h>
#include <bundle_icp/model/sparse_model_io.h>

#include <pcl/conversions.h>

namespace bundle_icp {

pcl::PointCloud<pcl::PointXYZRGB>::Ptr
toPointCloud(const ImageGraph& graph, const SparseModel& model, int component, bool cameras)
{
  pcl::PointCloud<pcl::PointXYZRGB>::Ptr cloud(new pcl::PointCloud<pcl::PointXYZRGB>);
  const auto add = [&](const Eigen::Vector3d& position, const cv::Vec3b& bgr) {
    pcl::PointXYZRGB point(bgr[2], bgr[1], bgr[0]);
    point.getVector3fMap() = position.cast<float>();
    cloud->push_back(point);
  };
  for (const ScenePoint& point : model.points()) {
    if (point.track.empty() || model.component(point.track.front().frame) != component)
      continue;
    Eigen::Vector3d color = Eigen::Vector3d::Zero();
    for (const Observation& o : point.track) {
      const cv::Vec3b& bgr = graph.features(o.frame).colors[o.feature];
      color += Eigen::Vector3d(bgr[0], bgr[1], bgr[2]) / double(point.track.size());
    }
    add(point.position, {uchar(color[0]), uchar(color[1]), uchar(color[2])});
  }
  if (cameras)
    for (const std::size_t frame : model.registeredFrames(component))
      add(model.worldFromCamera(frame).translation(), {0, 0, 255});
  return cloud;
}

void
writeSparseModel(const std::string& path, const ImageGraph& graph, const SparseModel& model,
                 int component)
{
  pcl::PolygonMesh cloud;
  pcl::toPCLPointCloud2(*toPointCloud(graph, model, component), cloud.cloud);
  writeMesh(path, cloud);
}

} // namespace bundle_icp

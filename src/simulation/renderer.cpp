// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "simulation/renderer.h"

#include "simulation/view.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace bundle_icp {
namespace simulation {
namespace {

/** Rays along each edge of a pixel in which faces meet. */
constexpr int EDGE_RAYS = 3;

cv::Vec3b
toPixel(const Eigen::Array4f& color)
{
  return {cv::saturate_cast<uchar>(color[0]), cv::saturate_cast<uchar>(color[1]),
          cv::saturate_cast<uchar>(color[2])};
}

/** Not zero for the pixels of a row a neighbour of which sees another face. */
void
findEdges(const cv::Mat& face, int y, std::vector<int>& is_edge)
{
  const int last = face.cols - 1;
  const int* row = face.ptr<int>(y);
  is_edge.assign(std::size_t(face.cols), 0);
  for (const int v : {std::max(y - 1, 0), y, std::min(y + 1, face.rows - 1)}) {
    const int* other = face.ptr<int>(v);
    for (int x = 1; x < last; ++x)
      is_edge[x] |= (other[x - 1] ^ row[x]) | (other[x] ^ row[x]) | (other[x + 1] ^ row[x]);
    is_edge[0] |= (other[0] ^ row[0]) | (other[1] ^ row[0]);
    is_edge[last] |= (other[last] ^ row[last]) | (other[last - 1] ^ row[last]);
  }
}

FaceSet
facesAround(const cv::Mat& face, int x, int y)
{
  FaceSet result;
  const auto begin = result.face.begin();
  for (int v = std::max(y - 1, 0); v <= std::min(y + 1, face.rows - 1); ++v)
    for (int u = std::max(x - 1, 0); u <= std::min(x + 1, face.cols - 1); ++u) {
      const int index = face.at<int>(v, u);
      if (index >= 0 && std::find(begin, begin + result.count, index) == begin + result.count)
        result.face[result.count++] = index;
    }
  std::sort(begin, begin + result.count);
  return result;
}

/** Colour of a pixel in which faces meet: rays find the share of each, which is shaded
 * once, in the ray that came last. */
Eigen::Array4f
edgeColor(const View& view, int x, int y, const FaceSet& faces)
{
  struct Part {
    int rays = 0;
    double u = 0, v = 0;
    Hit hit;
  };
  std::array<Part, std::tuple_size<decltype(faces.face)>::value + 1> parts;
  for (int i = 0; i < EDGE_RAYS * EDGE_RAYS; ++i) {
    const double u = x + (i % EDGE_RAYS + 0.5) / EDGE_RAYS - 0.5;
    const double v = y + (i / EDGE_RAYS + 0.5) / EDGE_RAYS - 0.5;
    const Hit hit = view.cast(u, v, faces);
    if (hit.face < 0) // a gap between them, too narrow for any central ray
      continue;
    const auto end = faces.face.begin() + faces.count;
    // A face that no neighbour's centre sees, the side of a thin box, goes into the
    // last part.
    Part& part = parts[std::find(faces.face.begin(), end, hit.face) - faces.face.begin()];
    part = {part.rays + 1, u, v, hit};
  }
  Eigen::Array4f sum = Eigen::Array4f::Zero();
  int rays = 0;
  for (const Part& part : parts)
    if (part.rays > 0) {
      const float size = std::sqrt(float(part.rays)) / EDGE_RAYS;
      sum += float(part.rays) * view.shade(part.u, part.v, part.hit, size);
      rays += part.rays;
    }
  return sum / float(std::max(rays, 1));
}

} // namespace

GeometryImage
renderGeometry(const Scene& scene, const CameraIntrinsics& camera, const Pose& world_from_camera)
{
  const View view(scene, camera, world_from_camera);
  GeometryImage image;
  image.depth.create(camera.height, camera.width, CV_32FC1);
  image.face.create(camera.height, camera.width, CV_32SC1);
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const Hit hit = view.cast(x, y);
      image.depth.at<float>(y, x) = float(hit.depth);
      image.face.at<int>(y, x) = hit.face;
    }
  return image;
}

cv::Mat
renderColor(const Scene& scene, const CameraIntrinsics& camera, const Pose& world_from_camera,
            const GeometryImage& geometry)
{
  const View view(scene, camera, world_from_camera);
  cv::Mat color(camera.height, camera.width, CV_8UC3, cv::Scalar::all(0));
  std::vector<int> is_edge;
  for (int y = 0; y < camera.height; ++y) {
    findEdges(geometry.face, y, is_edge);
    for (int x = 0; x < camera.width; ++x) {
      const Hit hit{geometry.depth.at<float>(y, x), geometry.face.at<int>(y, x)};
      if (is_edge[x])
        color.at<cv::Vec3b>(y, x) =
            toPixel(edgeColor(view, x, y, facesAround(geometry.face, x, y)));
      else if (hit.face >= 0)
        color.at<cv::Vec3b>(y, x) = toPixel(view.shade(x, y, hit, 1));
    }
  }
  return color;
}

cv::Mat
renderNormals(const Scene& scene, const CameraIntrinsics& camera, const Pose& world_from_camera,
              const GeometryImage& geometry)
{
  const View view(scene, camera, world_from_camera);
  cv::Mat normals(camera.height, camera.width, CV_32FC3);
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const Hit hit{geometry.depth.at<float>(y, x), geometry.face.at<int>(y, x)};
      const Eigen::Vector3f normal =
          hit.face >= 0 ? view.normal(x, y, hit) : Eigen::Vector3f::Zero();
      normals.at<cv::Vec3f>(y, x) = {normal.x(), normal.y(), normal.z()};
    }
  return normals;
}

cv::Mat
reflection(const Scene& scene, const CameraIntrinsics& camera, const Pose& world_from_camera,
           const GeometryImage& geometry, const cv::Mat& color)
{
  const cv::Mat normals = renderNormals(scene, camera, world_from_camera, geometry);
  const Eigen::Matrix3f rotation = world_from_camera.linear().cast<float>();
  cv::Mat result(color.size(), CV_32FC1);
  for (int y = 0; y < color.rows; ++y)
    for (int x = 0; x < color.cols; ++x) {
      if (geometry.face.at<int>(y, x) < 0) { // the room around a turntable
        result.at<float>(y, x) = 1;
        continue;
      }
      const cv::Vec3f& n = normals.at<cv::Vec3f>(y, x);
      const cv::Vec3b& bgr = color.at<cv::Vec3b>(y, x);
      const Eigen::Vector3f ray = rotation * camera.unproject(x, y, 1).cast<float>().normalized();
      const float cosine = -ray.dot(Eigen::Vector3f(n[0], n[1], n[2]));
      const float gray = float(bgr[0] + bgr[1] + bgr[2]) / 765;
      result.at<float>(y, x) = std::min(1.f, 2.5f * cosine) * std::min(1.f, 0.4f + 3 * gray);
    }
  return result;
}

} // namespace simulation
} // namespace bundle_icp

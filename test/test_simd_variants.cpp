// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "landmarks.h"
#include "scan/lone_depth.h"
#include "variants.h"

#include <bundle_icp/adjustment/bundle_adjustment.h>
#include <bundle_icp/common/calibration.h>
#include <bundle_icp/graph/feature_matching.h>
#include <bundle_icp/registration/bundle_icp.h>
#include <bundle_icp/volume/extract_surface.h>
#include <bundle_icp/volume/tsdf_volume.h>

#include <functional>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

using Point = pcl::PointXYZRGBNormal;

/** All bits of a result. */
std::string
bits(const cv::Mat& image)
{
  return std::string(reinterpret_cast<const char*>(image.data), image.total() * image.elemSize());
}

template <typename Element>
std::string
bits(const std::vector<Element>& elements)
{
  return std::string(reinterpret_cast<const char*>(elements.data()),
                     elements.size() * sizeof(Element));
}

template <int ROWS, int COLUMNS>
std::string
bits(const Eigen::Matrix<double, ROWS, COLUMNS>& matrix)
{
  return std::string(reinterpret_cast<const char*>(matrix.data()), sizeof(matrix));
}

DepthView
viewOf(unsigned frame, int reduction = 1)
{
  return makeDepthView(noisy(room().read(frame).depth, frame), room().camera(), reduction);
}

std::string
depthView(int reduction)
{
  const DepthView view = viewOf(0, reduction);
  return bits(view.depth) + bits(view.normals) + bits(view.weight);
}

std::string
depthAlone()
{
  cv::Mat depth(41, 83, CV_32FC1);
  cv::RNG random(3);
  random.fill(depth, cv::RNG::UNIFORM, 1, 3);
  return bits(loneDepth(depth));
}

std::string
virtualDepth()
{
  const DepthView views[] = {viewOf(0), viewOf(4), viewOf(8)};
  std::vector<RegisteredView> registered;
  for (std::size_t i = 0; i < 3; ++i)
    registered.push_back({&views[i], room().worldFromCamera(4 * i)});
  const VirtualDepth result =
      renderVirtualDepth(registered, room().camera(), room().worldFromCamera(5));
  return bits(result.depth) + bits(result.normals) + bits(result.variance);
}

std::string
alignment()
{
  BundleICP<Point, Point> reg;
  reg.setCameraIntrinsics(room().camera());
  reg.setInputSource(toPointCloud(viewOf(1)));
  reg.setInputTarget(toPointCloud(viewOf(0)));
  pcl::PointCloud<Point> aligned;
  reg.align(aligned);
  const Eigen::Matrix4d pose = reg.getFinalTransformation().cast<double>();
  return bits(pose) + bits(reg.getResult().information);
}

std::string
correctedDepths()
{
  Calibration calibration;
  calibration[CalibrationParameter::DEPTH_BIAS] = 0.01;
  calibration[CalibrationParameter::DEPTH_TILT_X] = 0.02;
  return bits(
      correctedDepth(room().read(0).depth, room().camera(), calibration, DepthError::Zero()));
}

std::string
smoothedSurface()
{
  TSDFOptions options;
  options.voxel_size = 0.02;
  options.truncation = 0.08;
  options.smoothing_radius = 2;
  TSDFVolume volume(options);
  for (const unsigned i : {0u, 4u})
    volume.integrate(room().read(i), room().camera(), room().worldFromCamera(i));
  const SurfaceMesh mesh = extractSurface(volume);
  return bits(mesh.vertices) + bits(mesh.colors);
}

std::string
descriptorMatches()
{
  std::string result;
  for (const FeatureMatch& match :
       matchDescriptors(roomFeatures(0).descriptors, roomFeatures(4).descriptors))
    result += std::to_string(match.first) + " " + std::to_string(match.second) + "\n";
  return result;
}

std::string
adjustedPoses()
{
  const Landmarks landmarks(100);
  const std::vector<LandmarkView> views = landmarkViews(landmarks, 5);
  const ImageGraph graph = toGraph(landmarks, views);
  SparseModel model(views.size());
  BundleAdjustmentProblem problem;
  for (std::size_t i = 0; i < views.size(); ++i) {
    model.registerFrame(graph, i, randomMotion(i, 0.01, 0.02) * views[i].world_from_camera, 0, {});
    problem.variable.push_back(i);
  }
  adjustBundle(graph, problem, {}, model);
  std::string result;
  for (std::size_t i = 0; i < views.size(); ++i)
    result += bits(model.worldFromCamera(i).matrix());
  return result;
}

struct Step {
  const char* name;
  std::function<std::string()> run;
};

void
PrintTo(const Step& step, std::ostream* out)
{
  *out << step.name;
}

class SimdVariants : public testing::TestWithParam<Step> {};

} // namespace

TEST_P(SimdVariants, GiveTheSameBits)
{
  simd::setVariant(simd::Variant::BASELINE);
  const std::string expected = GetParam().run();
  ASSERT_GT(expected.size(), 100u);
  forEachVariant([&] { EXPECT_TRUE(GetParam().run() == expected); });
}

INSTANTIATE_TEST_SUITE_P(, SimdVariants,
                         testing::Values(Step{"DepthView", [] { return depthView(1); }},
                                         Step{"ReducedDepthView", [] { return depthView(2); }},
                                         Step{"VirtualDepth", virtualDepth},
                                         Step{"Alignment", alignment},
                                         Step{"LoneDepth", depthAlone},
                                         Step{"CorrectedDepth", correctedDepths},
                                         Step{"SmoothedSurface", smoothedSurface},
                                         Step{"DescriptorMatches", descriptorMatches},
                                         Step{"AdjustedPoses", adjustedPoses}),
                         [](const auto& param_info) { return std::string(param_info.param.name); });

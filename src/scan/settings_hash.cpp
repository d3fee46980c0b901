// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/settings_hash.h"

#include "common/archive.h"
#include "scan/check_images.h"

#include <bundle_icp/version.h>

#include <opencv2/core/utility.hpp>

namespace boost {
namespace serialization {

using bundle_icp::archiveAll;

/** For options whose last field is num_threads. */
#define ARCHIVE_WITHOUT_THREADS(Struct, ...)                                                       \
  template <class Archive>                                                                         \
  void serialize(Archive& archive, bundle_icp::Struct& value, unsigned)                            \
  {                                                                                                \
    auto& [__VA_ARGS__, num_threads] = value;                                                      \
    archiveAll(archive, __VA_ARGS__);                                                              \
  }

// Of options, whatever changes the result: all but memory and numbers of threads.

BUNDLE_ICP_ARCHIVE(RigidAlignmentOptions, inlier_sigmas, max_samples, confidence, seed)
BUNDLE_ICP_ARCHIVE(DepthNoise, constant, quadratic, offset)
BUNDLE_ICP_ARCHIVE(FeatureOptions, max_features, contrast_threshold, image_reduction, depth_radius,
                   pixel_sigma)

template <class Archive>
void
serialize(Archive& archive, bundle_icp::MatchingOptions& value, unsigned)
{
  auto& [backend, ratio, min_matches, verification, max_memory, num_threads] = value;
  archiveAll(archive, backend, ratio, min_matches, verification);
}

template <class Archive>
void
serialize(Archive& archive, bundle_icp::RetrievalOptions& value, unsigned)
{
  auto& [vocabulary_size, training_size, num_threads, seed] = value;
  archiveAll(archive, vocabulary_size, training_size, seed);
}

BUNDLE_ICP_ARCHIVE(ImageGraphOptions, matching, retrieval, exhaustive_limit, key_similarity,
                   num_similar, num_similar_keys, num_neighbours_in_time, min_relative_sharpness)
ARCHIVE_WITHOUT_THREADS(VirtualDepthOptions, edge_distance, max_view_angle, merge_sigmas)
BUNDLE_ICP_ARCHIVE(FrameRegistrationOptions, method, visual_start, min_visual_inliers,
                   virtual_depth, max_views, min_overlap, max_position_deviation,
                   max_rotation_deviation, shared_depth_sigmas)
BUNDLE_ICP_ARCHIVE(TrackOptions, max_sigmas, max_pixel_error)
ARCHIVE_WITHOUT_THREADS(BundleAdjustmentOptions, solver, max_iterations, loss_scale,
                        function_tolerance, use_depth, depth_error_deviation)
ARCHIVE_WITHOUT_THREADS(SelfCalibrationOptions, camera, depth_errors, max_frames, min_track_length,
                        significance, min_gain, min_frames, max_iterations)
BUNDLE_ICP_ARCHIVE(RefinementOptions, self_calibration, calibration_test, calibration,
                   num_dense_neighbours, num_exact_dense_neighbours, motion_prior, pose_prior,
                   join_by_geometry)
BUNDLE_ICP_ARCHIVE(MappingSchedule, batch_size, adjustment_growth, global_adjustment,
                   ordered_in_time)
ARCHIVE_WITHOUT_THREADS(MapperOptions, registration, tracks, adjustment, refinement, schedule)

} // namespace serialization
} // namespace boost

namespace bundle_icp {
namespace {

/** To be raised by a change that gives other features, matches or poses. */
constexpr int REVISION = 3;

} // namespace

std::uint64_t
settingsHash(const std::string& bytes)
{
  // Another version may find other things, and SIFT, which is OpenCV's, does so without AVX2.
  const int versions[] = {REVISION,
                          BUNDLE_ICP_VERSION_NUMBER,
                          cv::getVersionMajor(),
                          cv::getVersionMinor(),
                          cv::getVersionRevision(),
                          int(cv::checkHardwareSupport(CV_CPU_AVX2))};
  std::string all = bytes + toArchive(versions);
  return hashOf(cv::Mat(1, int(all.size()), CV_8UC1, all.data()));
}

std::uint64_t
settingsHash(const FeatureOptions& options, const CameraIntrinsics& camera)
{
  return settingsHash(
      toArchive(camera.fx, camera.fy, camera.cx, camera.cy, camera.depth_noise, options));
}

std::uint64_t
settingsHash(const MatchingOptions& options)
{
  return settingsHash(toArchive(options));
}

std::uint64_t
settingsHash(const ImageGraphOptions& graph, const MapperOptions& mapper, int depth_reduction,
             const VirtualDepthOptions& view_options)
{
  return settingsHash(toArchive(graph, mapper, depth_reduction, view_options));
}

} // namespace bundle_icp

// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/stored_frames.h"

#include "scan/check_images.h"

#include <bundle_icp/version.h>

#include <boost/filesystem.hpp>
#include <opencv2/core/utility.hpp>

#include <map>

namespace bundle_icp {
namespace {

/** To be raised by a change that gives other features or matches. */
constexpr int REVISION = 1;

std::uint64_t
hashOf(std::vector<double> numbers)
{
  // Another version may find other things, and SIFT, which is OpenCV's, does so without AVX2.
  for (const int number :
       {REVISION, BUNDLE_ICP_VERSION_NUMBER, int(cv::getVersionMajor()), int(cv::getVersionMinor()),
        int(cv::getVersionRevision()), int(cv::checkHardwareSupport(CV_CPU_AVX2))})
    numbers.push_back(number);
  return bundle_icp::hashOf(cv::Mat(1, int(numbers.size()), CV_64F, numbers.data()));
}

/** Of all numbers that features depend on besides the images. */
std::uint64_t
settingsOf(const FeatureOptions& options, const CameraIntrinsics& camera)
{
  const DepthNoise& noise = camera.depth_noise;
  return hashOf({camera.fx, camera.fy, camera.cx, camera.cy, noise.constant, noise.quadratic,
                 noise.offset, double(options.max_features), options.contrast_threshold,
                 double(options.image_reduction), double(options.depth_radius),
                 options.pixel_sigma});
}

/** Of all numbers that the matches of two images depend on besides their features. */
std::uint64_t
settingsOf(const MatchingOptions& options)
{
  const RigidAlignmentOptions& verification = options.verification;
  return hashOf({double(options.backend), options.ratio, double(options.min_matches),
                 verification.inlier_sigmas, double(verification.max_samples),
                 verification.confidence, double(verification.seed)});
}

/** The name of a frame from the folder of its recording on, so that a recording may be moved. */
std::string
nameIn(std::string recording, const std::string& name)
{
  recording.erase(recording.find_last_not_of('/') + 1);
  const std::string folder = recording + "/";
  if (recording.empty() || name.compare(0, folder.size(), folder) != 0)
    return name;
  namespace fs = boost::filesystem;
  const fs::path place = fs::absolute(recording).lexically_normal();
  const fs::path last = place.filename() == "." ? place.parent_path().filename() : place.filename();
  return last.string() + "/" + name.substr(name.find_first_not_of('/', folder.size() - 1));
}

/** Frames of one name are told apart by their number. */
std::vector<std::string>
namesOf(const RGBDDataset& dataset)
{
  std::vector<std::string> names;
  std::map<std::string, std::size_t> times;
  for (std::size_t i = 0; i < dataset.size(); ++i) {
    names.push_back(nameIn(dataset.recording(i), dataset.name(i)));
    if (const std::size_t before = times[names.back()]++; before > 0)
      names.back() += "#" + std::to_string(before);
  }
  return names;
}

} // namespace

StoredFrames::StoredFrames(const RGBDDataset& dataset, const ReconstructionOptions& options)
: database_(options.database->path, options.database->fresh), camera_(dataset.camera()),
  feature_settings_(settingsOf(options.features, dataset.camera())),
  match_settings_(settingsOf(options.graph.matching)), names_(namesOf(dataset)),
  images_(dataset.size())
{
}

std::optional<Features>
StoredFrames::features(std::size_t frame, const RGBDFrame& rgbd)
{
  std::uint64_t parts[] = {bundle_icp::hashOf(rgbd.color), bundle_icp::hashOf(rgbd.depth),
                           feature_settings_};
  images_[frame] =
      database_.image(names_[frame], bundle_icp::hashOf(cv::Mat(1, 3, CV_64F, parts)), camera_);
  std::optional<Features> features = database_.features(images_[frame]);
  reused_features_ += features.has_value();
  return features;
}

void
StoredFrames::addFeatures(std::size_t frame, const Features& features)
{
  database_.addFeatures(images_[frame], features);
}

std::optional<FramePair>
StoredFrames::find(std::size_t first, std::size_t second)
{
  std::optional<FramePair> pair =
      database_.pair(imageOfNode(first), imageOfNode(second), match_settings_);
  reused_pairs_ += pair.has_value();
  return pair;
}

void
StoredFrames::add(const FramePair& pair)
{
  database_.addPair(imageOfNode(pair.first), imageOfNode(pair.second), match_settings_, pair,
                    camera_);
}

} // namespace bundle_icp

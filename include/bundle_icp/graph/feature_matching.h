// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/progress.h>
#include <bundle_icp/common/rigid_alignment.h>
#include <bundle_icp/graph/features.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace bundle_icp {

/** Search for nearest descriptors. Both back ends give FeatureMatch lists of the same meaning. */
enum class MatchingBackend {
  EXACT, ///< all products of descriptors, as a matrix product in integer arithmetic
  KDTREE ///< approximate: a kd-tree (pcl::search::FlannSearch), the same in every run
};

/** Name of a back end: exact, kdtree. */
BUNDLE_ICP_EXPORT std::string
toString(MatchingBackend backend);

/** The back end of that name, if there is one. */
BUNDLE_ICP_EXPORT std::optional<MatchingBackend>
parseMatchingBackend(const std::string& name);

/** How images are matched and how matches are verified. */
struct BUNDLE_ICP_EXPORT MatchingOptions {
  MatchingBackend backend = MatchingBackend::EXACT;
  /** Upper bound of the ratio between a match's distance and the second best distance. */
  double ratio = 0.8;
  /** M_th of equation (5): a pair with fewer verified matches gives no edge. */
  std::size_t min_matches = 15;
  /** Geometric verification: 3D-3D RANSAC, thresholds in sigmas of the depth noise. */
  RigidAlignmentOptions verification;
  /** Largest memory of the descriptors that are used at once [bytes], 0 = no limit. Where all need
   *  more, pairs are matched block by block; the result is the same. */
  std::size_t max_memory = 0;
  /** Threads to use, 0 = all. */
  int num_threads = 0;

  bool
  isValid(std::string* error = nullptr) const;
};

/** Feature `first` of one image and feature `second` of another see the same point. */
struct FeatureMatch {
  int first = 0;
  int second = 0;
};

/** M_ij of equation (3): the verified matches of two images, and the motion that they support. */
struct FramePair {
  std::size_t first = 0;
  std::size_t second = 0;
  std::vector<FeatureMatch> matches; ///< ascending in `first`, one to one
  Pose first_from_second = Pose::Identity();
  /** Of the same form: matches that agree on another motion, and that motion. Something moves
   *  between the images, or a texture repeats itself. */
  std::vector<FeatureMatch> matches_of_other_motion;
  Pose other_first_from_second = Pose::Identity();
  std::size_t num_putative = 0; ///< matches before verification
};

/** Keeps what matching found, for a later run with the same images and options. Several threads may
 *  call all methods at once. */
class BUNDLE_ICP_EXPORT MatchStore {
public:
  virtual ~MatchStore() = default;

  /** What verifyMatches() gave for two images, without matches where they share too few; unset when
   *  it is not known. */
  virtual std::optional<FramePair>
  find(std::size_t first, std::size_t second) = 0;

  /** Takes what verifyMatches() gave for images pair.first and pair.second. */
  virtual void
  add(const FramePair& pair) = 0;
};

/** One-to-one matches that pass the ratio test and the mutual test; ascending in `first`. */
BUNDLE_ICP_EXPORT std::vector<FeatureMatch>
matchDescriptors(const cv::Mat& first, const cv::Mat& second, const MatchingOptions& options = {});

/** Keeps the matches that agree on one rigid motion between measured points, that of most matches,
 *  and those that agree on another one. The result has no matches when fewer than
 *  options.min_matches agree. */
BUNDLE_ICP_EXPORT FramePair
verifyMatches(const Features& first, const Features& second,
              const std::vector<FeatureMatch>& putative, const CameraIntrinsics& camera,
              const MatchingOptions& options = {});

/** Matches and verifies the candidate pairs (indices into `features`) in parallel. Returns the
 *  pairs with an edge, in the order of the candidates. The result does not depend on the threads.
 *  \param store gives pairs that were matched before, and takes the others; may be null
 *  \throws pcl::BadArgumentException for invalid options or indices. */
BUNDLE_ICP_EXPORT std::vector<FramePair>
matchPairs(const std::vector<const Features*>& features, const CameraIntrinsics& camera,
           const std::vector<std::pair<std::size_t, std::size_t>>& candidates,
           const MatchingOptions& options = {}, const ProgressCallback& progress = {},
           MatchStore* store = nullptr);

} // namespace bundle_icp

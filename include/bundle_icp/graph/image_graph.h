// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/pose_prior.h>
#include <bundle_icp/common/progress.h>
#include <bundle_icp/graph/feature_matching.h>
#include <bundle_icp/graph/image_retrieval.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace bundle_icp {

/** How an ImageGraph is built. */
struct BUNDLE_ICP_EXPORT ImageGraphOptions {
  MatchingOptions matching;
  RetrievalOptions retrieval;
  /** Largest number of frames of which every pair is matched. With more frames, key frames are
   *  chosen that cover the scan, and the cost of matching is linear in the number of frames. */
  std::size_t exhaustive_limit = 300;
  /** Minimum similarity of every frame to a key frame, 0 ... 1, as a share of
   *  ImageRetrieval::typicalSimilarity(), that of frames of the same place. A lower value is
   *  faster, but connects long scans less well. */
  double key_similarity = 0.75;
  /** Number of similar key frames that each frame is matched with (beyond exhaustive_limit). */
  std::size_t num_similar = 12;
  /** Number of similar key frames that each key frame is matched with. */
  std::size_t num_similar_keys = 60;
  /** Number of frames before and after in time that each frame is matched with, when the order in
   *  time is known. */
  std::size_t num_neighbours_in_time = 2;
  /** A frame counts as blurred and is left out when its sharpness is below this share of the
   *  median sharpness of its neighbours in the graph. */
  double min_relative_sharpness = 0.3;

  bool
  isValid(std::string* error = nullptr) const;
};

/** A frame to add to the graph. */
struct ImageNode {
  Features features;
  double timestamp = 0; ///< [s]
  std::optional<PosePrior> prior = {};
};

/** An edge, seen from one of its nodes. */
struct ImageEdge {
  std::size_t neighbour = 0;
  const FramePair* pair = nullptr; ///< the node is pair->first or pair->second
};

/** The image graph of section 2.1: nodes N_i with their features, edges E_ij with their matches
 *  M_ij where |M_ij| >= M_th (equation 5). A frame's index is its place in the order of append().
 *  Only append() and releaseDescriptors() change the graph. */
class BUNDLE_ICP_EXPORT ImageGraph {
public:
  using Ptr = std::shared_ptr<ImageGraph>;
  using ConstPtr = std::shared_ptr<const ImageGraph>;

  /** \throws pcl::BadArgumentException for invalid options or camera. */
  explicit ImageGraph(const CameraIntrinsics& camera, const ImageGraphOptions& options = {});
  ~ImageGraph();
  ImageGraph(ImageGraph&&) noexcept;
  ImageGraph&
  operator=(ImageGraph&&) noexcept;

  /** Adds frames and matches them with each other and with the frames of the graph. Pointers and
   *  references to existing nodes and edges become invalid.
   *  \param ordered_in_time true when close time stamps make two frames likely neighbours
   *  \param store as of matchPairs()
   *  \return false when `progress` asked to stop; edges are then missing.
   *  \throws pcl::BadArgumentException after releaseDescriptors(). */
  bool
  append(std::vector<ImageNode> frames, bool ordered_in_time, const ProgressCallback& progress = {},
         MatchStore* store = nullptr);

  /** Frees the descriptors, the largest part of a graph. Afterwards no frames can be appended.
   *  \param keep_key_frames keeps the descriptors of key frames: a mapper finds further matches
   *  with them. */
  void
  releaseDescriptors(bool keep_key_frames = false);

  std::size_t
  size() const;

  const CameraIntrinsics&
  camera() const;

  const Features&
  features(std::size_t frame) const;

  double
  timestamp(std::size_t frame) const;

  const std::optional<PosePrior>&
  prior(std::size_t frame) const;

  /** Edges of a node in ascending order of the neighbour. */
  std::vector<ImageEdge>
  edges(std::size_t frame) const;

  std::size_t
  numEdges() const;

  /** Cor of equation (4): sum of the numbers of matches over all edges of the node. */
  std::size_t
  correspondences(std::size_t frame) const;

  /** True for frames chosen to cover the scan; true for all frames when every pair was matched. */
  bool
  isKey(std::size_t frame) const;

  /** Why a frame is left out ("no other frame ...", "blurred: ..."); empty when it takes part. */
  const std::string&
  exclusion(std::size_t frame) const;

private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

} // namespace bundle_icp

// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/progress.h>
#include <bundle_icp/graph/feature_matching.h>
#include <bundle_icp/graph/image_retrieval.h>

#include <memory>
#include <string>
#include <vector>

namespace bundle_icp {

/** How an ImageGraph is built. */
struct BUNDLE_ICP_EXPORT ImageGraphOptions {
  MatchingOptions matching;
  RetrievalOptions retrieval;
  /** Up to so many images every pair is matched; beyond it, key images are chosen that cover
   *  the scan, and matching stays linear in the number of images. */
  std::size_t exhaustive_limit = 300;
  /** Every image has a key image at least so similar, as a share of the similarity that is typical
   *  of images that show the same, ImageRetrieval::typicalSimilarity(): 0 ... 1. Lower is faster,
   *  and leaves long scans less well connected. */
  double key_similarity = 0.75;
  /** Each image is matched with so many most similar key images (beyond exhaustive_limit). */
  std::size_t num_similar = 12;
  /** Each key image is matched with so many most similar key images. */
  std::size_t num_similar_keys = 60;
  /** Each image is matched with so many images before and after it in time, when the order in
   *  time is known. */
  std::size_t num_neighbours_in_time = 2;
  /** An image whose sharpness is below this share of the median of the images that it has an edge
   *  with is left out as blurred. */
  double min_relative_sharpness = 0.3;

  bool
  isValid(std::string* error = nullptr) const;
};

/** An image to be added to the graph. */
struct ImageNode {
  Features features;
  double timestamp = 0; ///< [s]
};

/** An edge as seen from one of its nodes. */
struct ImageEdge {
  std::size_t neighbour = 0;
  const FramePair* pair = nullptr; ///< pair->first or pair->second is the node itself
};

/** The image graph of section 2.1: nodes N_i with their features, edges E_ij with their matches
 *  M_ij where |M_ij| >= M_th (equation 5). Indices count the images in the order in which
 *  they were appended. Const but for append() and
 *  releaseDescriptors(). */
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

  /** Adds images and matches them with each other and with those already there. Pointers and
   *  references to existing nodes and edges become invalid.
   *  \param ordered_in_time whether close time stamps make two images likely neighbours.
   *  \return false when `progress` asked to stop: then edges are missing.
   *  \throws pcl::BadArgumentException after releaseDescriptors(). */
  bool
  append(std::vector<ImageNode> images, bool ordered_in_time,
         const ProgressCallback& progress = {});

  /** Frees the descriptors, the largest part of a graph: no more images can be appended.
   *  \param keep_key_images leaves those of key images, with which a mapper finds further matches.
   *  */
  void
  releaseDescriptors(bool keep_key_images = false);

  std::size_t
  size() const;

  const CameraIntrinsics&
  camera() const;

  const Features&
  features(std::size_t image) const;

  double
  timestamp(std::size_t image) const;

  /** Edges of a node, ascending by neighbour. */
  std::vector<ImageEdge>
  edges(std::size_t image) const;

  std::size_t
  numEdges() const;

  /** Cor of equation (4): sum of the numbers of matches over all edges of the node. */
  std::size_t
  correspondences(std::size_t image) const;

  /** True for images chosen to cover the scan; all are when every pair was matched. */
  bool
  isKey(std::size_t image) const;

  /** Why an image takes no part ("no other image ...", "blurred: ..."); empty when it does. */
  const std::string&
  exclusion(std::size_t image) const;

private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

} // namespace bundle_icp

// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "scan/stored_map.h"

#include <bundle_icp/io/rgbd_dataset.h>
#include <bundle_icp/reconstruction.h>

#include <atomic>
#include <string>
#include <utility>
#include <vector>

namespace bundle_icp {

/** The frames of a dataset in a scan database. What a frame's features are made from is told by the
 *  pixels that the reader gives, whatever file, option or mask they come from. Several threads may
 *  call all methods but setNodes() at once. */
class StoredFrames : public MatchStore {
public:
  /** Needs options.database.
   *  \throws pcl::IOException when its file cannot be used. */
  StoredFrames(const RGBDDataset& dataset, const ReconstructionOptions& options);

  /** Features of the same pixels, found in an earlier run; unset when there are none.
   *  \param frame index in the dataset */
  std::optional<Features>
  features(std::size_t frame, const RGBDFrame& rgbd);

  /** After features() of that frame. */
  void
  addFeatures(std::size_t frame, const Features& features);

  /** Frames of the nodes that find() and add() are asked for. */
  void
  setNodes(std::vector<std::size_t> frame_of_node)
  {
    frame_of_node_ = std::move(frame_of_node);
  }

  std::optional<FramePair>
  find(std::size_t first, std::size_t second) override;

  void
  add(const FramePair& pair) override;

  /** The map of the graph of all nodes, which this object has to outlive.
   *  \param settings hash of all options that it depends on besides those of features */
  std::unique_ptr<StoredMap>
  map(const ImageGraph& graph, std::uint64_t settings);

  /** Keeps what was added until now. */
  void
  commit()
  {
    database_.commit();
  }

  ReusedWork
  reused() const
  {
    return {reused_features_, reused_pairs_};
  }

private:
  ScanDatabase::ImageId
  imageOfNode(std::size_t node) const
  {
    return images_[frame_of_node_[node]];
  }

  ScanDatabase database_;
  const CameraIntrinsics camera_;
  const std::uint64_t feature_settings_, match_settings_;
  std::vector<std::string> names_;
  std::vector<ScanDatabase::ImageId> images_; ///< of the frames
  std::vector<std::uint64_t> contents_;       ///< of the frames: hash of all that features are of
  std::vector<std::size_t> frame_of_node_;
  std::atomic<std::size_t> reused_features_{0}, reused_pairs_{0};
};

} // namespace bundle_icp

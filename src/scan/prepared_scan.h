// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "common/array_store.h"
#include "scan/depth_view_store.h"
#include "scan/filtered_dataset.h"
#include "scan/staying_pixels.h"
#include "scan/stored_frames.h"

#include <bundle_icp/reconstruction.h>

namespace bundle_icp {

/** Wall time of stages by name [s]. */
using Timing = std::vector<std::pair<std::string, double>>;

class PreparedScan::Impl {
public:
  Impl(const RGBDDataset& dataset, const ReconstructionOptions& options);

  /** What is wrong with the recording, from a share of its frames that takes hardly any time; and
   *  what stays in its images, which the frames lose from then on. */
  const std::vector<Finding>&
  needCheck(Timing& timing);

  /** Equation (2): features with depth, and the depth that Bundle ICP will need. The stage's time
   *  is added to `timing`, also when the stage has run before. \return false when the stage was
   *  stopped. */
  bool
  needFeatures(const ProgressCallback& progress, Timing& timing);

  /** Equations (3) to (5), after needFeatures(): the readable frames, in an order that
   * follows from their content, become nodes. */
  bool
  needGraph(const ProgressCallback& progress, Timing& timing);

  const ReconstructionOptions&
  options() const
  {
    return options_;
  }

  const RGBDDataset&
  dataset() const
  {
    return dataset_;
  }

  /** Report of each frame before there are poses. */
  const std::vector<FrameReport>&
  frames() const
  {
    return frames_;
  }

  /** After needCheck(): what stays in the image while other things move. */
  const StayingPixels&
  staying() const
  {
    return staying_;
  }

  /** After needFeatures() and before releaseDescriptors(). */
  const Features&
  features(std::size_t frame) const;

  /** After needGraph(). */
  const std::shared_ptr<ImageGraph>&
  graph() const
  {
    return graph_;
  }

  /** After needGraph(): index of the frame of each node of the graph. */
  const std::vector<std::size_t>&
  frameOfNode() const
  {
    return frame_of_node_;
  }

  /** What the stages that were run took from the database. */
  const ReusedWork&
  reused() const
  {
    return reused_;
  }

  DepthViewStore&
  depthViews()
  {
    return depth_views_;
  }

  /** After needGraph(): where the mapper's state is kept; null when it is not kept. */
  std::unique_ptr<StoredMap>
  storedMap(const MapperOptions& mapper) const;

  /** Others may use the file of the database from here on. No other reconstruction may follow. */
  void
  releaseDatabase()
  {
    stored_.reset();
  }

  /** Frees data that matched frames no longer need. No other reconstruction may follow. */
  void
  releaseDescriptors(bool keep_key_frames = false);

  /** Frees data that is not needed once there are poses. No other reconstruction may follow. */
  void
  releaseDepth();

private:
  /** A stage runs once, even if it is stopped. */
  struct Stage {
    bool was_run = false, completed = false;
    double seconds = 0;
  };
  template <class Body>
  bool
  runOnce(const char* name, Stage& stage, Timing& timing, const Body& body);
  void
  findStaying();
  void
  extract(std::size_t i);
  bool
  extractAll(const ProgressCallback& progress);
  bool
  buildGraph(const ProgressCallback& progress);

  FilteredDataset dataset_;
  const ReconstructionOptions options_;
  std::vector<FrameReport> frames_;
  std::vector<ImageNode> nodes_; ///< of each frame, until the graph takes them
  std::vector<std::size_t> frame_of_node_, node_of_frame_;
  std::shared_ptr<ImageGraph> graph_;
  std::unique_ptr<StoredFrames> stored_; ///< null = nothing is kept on disk any more
  ReusedWork reused_;
  ArrayStore descriptors_;
  DepthViewStore depth_views_;
  StayingPixels staying_;
  std::vector<Finding> check_findings_;
  Stage check_stage_, features_stage_, graph_stage_;
};

} // namespace bundle_icp

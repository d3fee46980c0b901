// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "mapping/mapper_state.h"

#include <functional>
#include <vector>

namespace bundle_icp {

/** The loop of section 2.2: it begins with the pair of strongest correlation, adds the frame of
 *  highest visibility by Bundle ICP (Algorithm 1), updates points and visibility, and adjusts the
 *  model as it grows. Works on the component MapperState::component, and keeps all that it knows in
 *  that state, so that it goes on from any state that it was in between two frames. */
class ComponentGrowth {
public:
  /** Called after each batch of frames; returns whether to go on. */
  using Step = std::function<bool()>;

  ComponentGrowth(const ImageGraph& graph, const FrameRegistrar& registrar,
                  ComponentAdjuster& adjuster, const MapperOptions& options, MapperState& state)
  : graph_(graph), registrar_(registrar), adjuster_(adjuster), options_(options), state_(state)
  {
  }

  /** The first pair of a component. \return false when no pair is left that can be one. */
  bool
  initialise(SparseModel& model);

  /** To be called before growth begins, not where it goes on. */
  void
  begin(const SparseModel& model);

  /** Adds key frames until no false connection is left among them. \return false when stopped. */
  bool
  addKeyFrames(SparseModel& model, const Step& step);

  /** Adds frames until no frame can be added. \return false when stopped. */
  bool
  addFrames(SparseModel& model, bool keys_only, const Step& step);

  /** V of all frames, after the tracks of all frames may have changed. */
  void
  updateVisibilities(const SparseModel& model);

private:
  std::vector<std::size_t>
  nextFrames(const SparseModel& model, bool keys_only) const;
  std::vector<FrameRegistration>
  registerFrames(const SparseModel& model, const std::vector<std::size_t>& frames) const;
  void
  addToModel(SparseModel& model, std::size_t frame, const FrameRegistration& registration);
  void
  adjust(SparseModel& model, const std::vector<std::size_t>& added);
  void
  updateVisibility(const SparseModel& model, std::size_t frame);

  const ImageGraph& graph_;
  const FrameRegistrar& registrar_;
  ComponentAdjuster& adjuster_;
  const MapperOptions& options_;
  MapperState& state_;
};

} // namespace bundle_icp

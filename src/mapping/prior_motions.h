// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/adjustment/bundle_adjustment.h>
#include <bundle_icp/mapping/incremental_mapper.h>

#include <optional>
#include <utility>
#include <vector>

namespace bundle_icp {

/** A motion between two frames as their prior poses say it, and its standard deviations along and
 *  about each axis [m, rad]; infinite where it says nothing. */
struct PriorMotion {
  Pose first_from_second = Pose::Identity();
  double position_sigma = 0, rotation_sigma = 0;

  /** As evidence; position and rotation have independent errors. */
  RelativePoseTerm
  term(std::size_t first, std::size_t second) const;
};

/** What the data say of prior poses. */
struct PriorTrust {
  double position_factor = 1, rotation_factor = 1; ///< on the deviations, 1 ... infinity
  PosePriorReport report;                          ///< of the last PriorMotions::measure()
};

/** The motions that prior poses say, trusted as far as the data confirm them: where the data show
 *  larger errors than the prior's deviations, these grow, and never shrink again. */
class PriorMotions {
public:
  /** Without RefinementOptions::pose_prior as if no frame had a prior. Says nothing without
   *  MappingSchedule::ordered_in_time. */
  PriorMotions(const ImageGraph& graph, const MapperOptions& options);

  /** Forgets what was measured. */
  void
  forget();

  /** Compares the motions between `frames` that follow each other in time with the poses of
   *  `model`, which should come from its own data. */
  void
  measure(const SparseModel& model, const std::vector<std::size_t>& frames);

  /** Evidence on the motions between `frames` that follow each other in time, without those that
   *  contradict the poses of `model`. */
  std::vector<RelativePoseTerm>
  terms(const SparseModel& model, const std::vector<std::size_t>& frames) const;

  /** A motion with the deviations that the data leave it; unset where a frame has no prior, before
   *  measure(), and when that found nothing to trust. */
  std::optional<PriorMotion>
  between(std::size_t first, std::size_t second) const;

  const PriorTrust&
  trust() const
  {
    return trust_;
  }

  /** \param trust of an earlier run on the same frames */
  void
  setTrust(const PriorTrust& trust)
  {
    trust_ = trust;
  }

private:
  using Pair = std::pair<std::size_t, std::size_t>;
  std::vector<Pair>
  pairsOf(const std::vector<std::size_t>& frames) const;
  std::optional<PriorMotion>
  said(std::size_t first, std::size_t second) const;

  const ImageGraph& graph_;
  std::vector<std::size_t> place_in_time_; ///< of each frame; empty = not used
  PriorTrust trust_;
};

} // namespace bundle_icp

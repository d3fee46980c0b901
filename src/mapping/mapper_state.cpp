// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "mapping/mapper_state.h"

#include "common/archive.h"

namespace boost {
namespace serialization {

using bundle_icp::archiveAll;

BUNDLE_ICP_ARCHIVE(Observation, frame, feature)
BUNDLE_ICP_ARCHIVE(ScenePoint, position, track)

/** Bases cannot be bound together with what they are a base of. */
template <class Archive>
void
serialize(Archive& archive, bundle_icp::FrameRegistration& value, unsigned)
{
  auto& [world_from_camera, depth_error, covariance] =
      static_cast<bundle_icp::PoseEstimate&>(value);
  archiveAll(archive, world_from_camera, depth_error, covariance, value.registered, value.reason,
             value.matches, value.inliers, value.icp_rmse, value.overlap, value.by_geometry,
             value.position_deviation, value.rotation_deviation);
}

BUNDLE_ICP_ARCHIVE(CalibrationTest, name, parameters, applied, gain, significance, implausible)
BUNDLE_ICP_ARCHIVE(WantedFocalLength, x, y, deviation)
BUNDLE_ICP_ARCHIVE(SelfCalibrationResult, tests, calibrated, depth_errors, wanted_focal)
BUNDLE_ICP_ARCHIVE(PosePriorReport, frames, motions, left_out, said_position, said_rotation,
                   measured_position, measured_rotation, uses_position, uses_rotation)
BUNDLE_ICP_ARCHIVE(PriorTrust, position_factor, rotation_factor, report)
BUNDLE_ICP_ARCHIVE(RelativePoseTerm, first, second, first_from_second, information, is_dense)
BUNDLE_ICP_ARCHIVE(AdjusterState, self_calibration, calibrated_component, num_dense_neighbours,
                   prior_trust, measured_component, terms)
BUNDLE_ICP_ARCHIVE(ComponentJoint, first_frames, second_frames, held_frames, overlap, agreement,
                   matches, support, runner_up_support)
BUNDLE_ICP_ARCHIVE(GrowthState, round, failed, next_adjustment, size_at_failure)
BUNDLE_ICP_ARCHIVE(MapperState, stage, component, growth, registrations, visibility, covariances,
                   pose_prior, joints, adjuster)

} // namespace serialization
} // namespace boost

namespace bundle_icp {

template <class Archive>
void
SparseModel::serialize(Archive& archive, unsigned)
{
  archiveAll(archive, frames_, points_, calibration_);
}

template <class Archive>
void
SparseModel::Frame::serialize(Archive& archive, unsigned)
{
  archiveAll(archive, world_from_camera, component, depth_error, motion, points);
}

std::string
toBytes(const MapperState& state, const SparseModel& model)
{
  return toArchive(state, model);
}

void
fromBytes(const std::string& bytes, MapperState& state, SparseModel& model)
{
  fromArchive(bytes, state, model);
}

} // namespace bundle_icp

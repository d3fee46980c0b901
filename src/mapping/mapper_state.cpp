// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "mapping/mapper_state.h"

#include "common/archive.h"

namespace boost {
namespace serialization {

using bundle_icp::archiveAll;

template <class Archive>
void
serialize(Archive& archive, bundle_icp::Observation& value, unsigned)
{
  auto& [frame, feature] = value;
  archiveAll(archive, frame, feature);
}

template <class Archive>
void
serialize(Archive& archive, bundle_icp::ScenePoint& value, unsigned)
{
  auto& [position, track] = value;
  archiveAll(archive, position, track);
}

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

template <class Archive>
void
serialize(Archive& archive, bundle_icp::CalibrationTest& value, unsigned)
{
  auto& [name, parameters, applied, gain, significance, implausible] = value;
  archiveAll(archive, name, parameters, applied, gain, significance, implausible);
}

template <class Archive>
void
serialize(Archive& archive, bundle_icp::WantedFocalLength& value, unsigned)
{
  auto& [x, y, deviation] = value;
  archiveAll(archive, x, y, deviation);
}

template <class Archive>
void
serialize(Archive& archive, bundle_icp::SelfCalibrationResult& value, unsigned)
{
  auto& [tests, calibrated, depth_errors, wanted_focal] = value;
  archiveAll(archive, tests, calibrated, depth_errors, wanted_focal);
}

template <class Archive>
void
serialize(Archive& archive, bundle_icp::PosePriorReport& value, unsigned)
{
  auto& [frames, motions, left_out, said_position, said_rotation, measured_position,
         measured_rotation, uses_position, uses_rotation] = value;
  archiveAll(archive, frames, motions, left_out, said_position, said_rotation, measured_position,
             measured_rotation, uses_position, uses_rotation);
}

template <class Archive>
void
serialize(Archive& archive, bundle_icp::PriorTrust& value, unsigned)
{
  auto& [position_factor, rotation_factor, report] = value;
  archiveAll(archive, position_factor, rotation_factor, report);
}

template <class Archive>
void
serialize(Archive& archive, bundle_icp::RelativePoseTerm& value, unsigned)
{
  auto& [first, second, first_from_second, information, is_dense] = value;
  archiveAll(archive, first, second, first_from_second, information, is_dense);
}

template <class Archive>
void
serialize(Archive& archive, bundle_icp::AdjusterState& value, unsigned)
{
  auto& [self_calibration, calibrated_component, num_dense_neighbours, prior_trust,
         measured_component, terms] = value;
  archiveAll(archive, self_calibration, calibrated_component, num_dense_neighbours, prior_trust,
             measured_component, terms);
}

template <class Archive>
void
serialize(Archive& archive, bundle_icp::GrowthState& value, unsigned)
{
  auto& [round, failed, next_adjustment, size_at_failure] = value;
  archiveAll(archive, round, failed, next_adjustment, size_at_failure);
}

template <class Archive>
void
serialize(Archive& archive, bundle_icp::MapperState& value, unsigned)
{
  auto& [stage, component, growth, registrations, visibility, covariances, pose_prior, adjuster] =
      value;
  archiveAll(archive, stage, component, growth, registrations, visibility, covariances, pose_prior,
             adjuster);
}

} // namespace serialization
} // namespace boost

namespace bundle_icp {

template <class Archive>
void
SparseModel::serialize(Archive& archive, unsigned)
{
  archive& frames_& points_& calibration_;
}

template <class Archive>
void
SparseModel::Frame::serialize(Archive& archive, unsigned)
{
  archive& world_from_camera& component& depth_error& motion& points;
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

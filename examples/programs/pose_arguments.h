// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
//
// Options for poses that are known beforehand, as a prior or as they are.
#pragma once

#include "program.h"

#include <bundle_icp/io/trajectory.h>
#include <bundle_icp/reconstruction.h>

#include <boost/program_options.hpp>
#include <pcl/exceptions.h>

#include <cmath>
#include <sstream>
#include <string>

namespace bundle_icp {

/** Stands for a file: the poses that the recording brings itself. */
constexpr const char* RECORDED_POSES = "recording";

struct PoseArguments {
  std::string prior; ///< FILE[,SIGMA]
  std::string poses; ///< FILE
};

inline boost::program_options::options_description
describePoses(PoseArguments& arguments)
{
  namespace po = boost::program_options;
  po::options_description options("Known poses");
  auto add = options.add_options();
  add("pose-prior", po::value(&arguments.prior)->value_name("FILE[,SIGMA]"),
      "poses of the colour camera from elsewhere (a phone, a robot arm, an IMU), in TUM format and "
      "any world, matched with frames within --max-time-difference; or recording: those that the "
      "recording's device estimated. They help where images and depth say little, and are never "
      "trusted against them. SIGMA is the standard deviation of the motion from one frame to the "
      "next [m], 0.01 if not given; that of the rotation is 0.5 degrees for each 0.01 m");
  add("poses", po::value(&arguments.poses)->value_name("FILE"),
      "poses of the colour camera, in TUM format, that are taken as they are, matched with frames "
      "within --max-time-difference; or recording: those of the recording. The surface is made "
      "with them alone, in their world, without features and registration");
  return options;
}

/** What "FILE[,SIGMA]" says; a comma that no number follows is part of the name. */
inline PosePriorOptions
parsePosePrior(const std::string& text)
{
  PosePriorOptions prior;
  prior.source = text;
  const std::size_t comma = text.rfind(',');
  if (comma != std::string::npos) {
    std::istringstream stream(text.substr(comma + 1));
    double sigma = 0;
    if (stream >> sigma && stream.peek() == EOF) {
      if (!(std::isfinite(sigma) && sigma > 0))
        throw UsageError("--pose-prior " + text + ": SIGMA must be above 0 [m]");
      prior.rotation_sigma *= sigma / prior.position_sigma;
      prior.position_sigma = sigma;
      prior.source = text.substr(0, comma);
    }
  }
  return prior;
}

/** Reads the files of poses. */
inline void
applyPoses(const PoseArguments& arguments, DatasetOptions& dataset,
           ReconstructionOptions& reconstruction)
{
  if (!arguments.prior.empty() && !arguments.poses.empty())
    throw UsageError("--pose-prior and --poses: poses are either a prior or taken as they are");
  if (reconstruction.method != ReconstructionMethod::BUNDLE_ICP) {
    if (!arguments.prior.empty())
      throw UsageError("--pose-prior: only the method bundle_icp uses a prior");
    if (!arguments.poses.empty())
      throw UsageError("--poses: poses that are given need no --method");
  }
  if (!arguments.poses.empty() && reconstruction.moving == MovingPart::OBJECT)
    throw UsageError("--poses: not with --moving object");
  if (!arguments.prior.empty()) {
    PosePriorOptions prior = parsePosePrior(arguments.prior);
    if (prior.source != RECORDED_POSES)
      prior.trajectory = readTrajectory(prior.source);
    dataset.pose_prior = prior;
  }
  if (!arguments.poses.empty() && arguments.poses != RECORDED_POSES)
    reconstruction.poses =
        GivenPoses{readTrajectory(arguments.poses), arguments.poses, dataset.max_time_difference};
}

/** The poses of an opened recording, where --poses asks for them. */
inline void
takeRecordedPoses(const PoseArguments& arguments, const std::string& scan,
                  double max_time_difference, const RGBDDataset& dataset,
                  ReconstructionOptions& reconstruction)
{
  if (arguments.poses != RECORDED_POSES)
    return;
  reconstruction.poses = GivenPoses{dataset.groundTruth(), "the recording", max_time_difference};
  if (reconstruction.poses->trajectory.empty())
    throw pcl::IOException(scan + ": --poses recording: the recording brings no poses");
}

} // namespace bundle_icp

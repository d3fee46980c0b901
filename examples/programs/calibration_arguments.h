// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
//
// Options for a camera's known calibration and for self-calibration.
#pragma once

#include "scan_arguments.h"

#include <bundle_icp/io/calibration_io.h>
#include <bundle_icp/reconstruction.h>

#include <boost/program_options.hpp>

#include <cmath>
#include <optional>
#include <sstream>
#include <string>

namespace bundle_icp {

struct CalibrationArguments {
  bool is_off = false;
  std::string file;                   ///< calibration of an earlier scan
  std::optional<double> depth_factor; ///< true length over measured length
};

/** True over measured length of "MEASURED,TRUE". */
inline double
parseKnownDistance(const std::string& text)
{
  std::istringstream stream(text);
  double measured = 0, exact = 0;
  char comma = 0;
  if (!(stream >> measured >> comma >> exact) || comma != ',' || stream.peek() != EOF ||
      !(measured > 0 && exact > 0))
    throw UsageError("--known-distance " + text +
                     ": expected MEASURED,TRUE, two lengths above 0 [m]");
  Calibration calibration;
  calibration.scaleDepth(exact / measured);
  if (!calibration.isValid())
    throw UsageError("--known-distance " + text +
                     ": the lengths differ by a factor of 2 or more; see --depth-scale");
  return exact / measured;
}

inline boost::program_options::options_description
describeCalibration(CalibrationArguments& arguments)
{
  namespace po = boost::program_options;
  po::options_description options("Calibration");
  auto add = options.add_options();
  add("calibration", po::value(&arguments.file)->value_name("FILE"),
      "OUT/calibration.json of an earlier scan with this camera: its corrections are applied "
      "unchanged, and only the depth error of each image is estimated; default: corrections that "
      "the scan supports are estimated");
  add("known-distance",
      po::value<std::string>()
          ->value_name("MEASURED,TRUE")
          ->notifier([&arguments](const std::string& text) {
            arguments.depth_factor = parseKnownDistance(text);
          }),
      "a length in a reconstruction made with the same calibration, and its true value [m]: all "
      "depth is scaled by TRUE / MEASURED, a factor that no scan can show; default: depth as "
      "recorded");
  add("no-calibration", po::bool_switch(&arguments.is_off), "estimate no corrections");
  return options;
}

/** Opens a scan with the known calibration of its camera, which `mapper` gets, too. */
inline RGBDDataset::Ptr
openCalibrated(const std::string& scan, DatasetOptions options,
               const CalibrationArguments& arguments, MapperOptions& mapper)
{
  const RGBDDataset::Ptr dataset = openDataset(scan, options);
  Calibration& calibration = mapper.refinement.calibration;
  if (!arguments.file.empty()) {
    calibration = readCalibration(arguments.file, dataset->camera());
    mapper.refinement.calibration_test.camera = false;
  }
  if (arguments.is_off) {
    mapper.refinement.calibration_test.camera = mapper.refinement.calibration_test.depth_errors =
        false;
    // A known rolling shutter needs the motions that self-calibration estimates.
    mapper.refinement.self_calibration = !arguments.file.empty();
  }
  if (arguments.depth_factor)
    calibration.scaleDepth(*arguments.depth_factor);
  std::string error;
  if (!calibration.isValid(&error))
    throw UsageError("--known-distance with " + arguments.file + ": " + error);
  if (calibration.depth_scale == 1)
    return dataset;
  options.depth_factor = calibration.depth_scale;
  return openDataset(scan, options);
}

} // namespace bundle_icp

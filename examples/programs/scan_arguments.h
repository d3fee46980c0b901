// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
//
// Shared by the programs that reconstruct scans: options of the recording, output folder.
#pragma once

#include "program.h"

#include <bundle_icp/io/calibration_io.h>
#include <bundle_icp/io/rgbd_dataset.h>
#include <bundle_icp/scan/estimate_intrinsics.h>

#include <boost/program_options.hpp>
#include <pcl/exceptions.h>

#include <optional>
#include <string>

namespace bundle_icp {

inline boost::program_options::options_description
describeRecording(DatasetOptions& dataset)
{
  namespace po = boost::program_options;
  po::options_description options("Recording");
  auto add = options.add_options();
  add("intrinsics", po::value<std::string>()->value_name("FX,FY,CX,CY[,K1,K2,P1,P2,K3]"),
      "intrinsics of the recorded images [px], instead of those of the format; or estimate: the "
      "focal length is estimated from the images, starting from a horizontal field of view of 60 "
      "degrees, with square pixels and the axis in the middle");
  add("depth-intrinsics", po::value<std::string>()->value_name("FX,FY,CX,CY[,K1,K2,P1,P2,K3]"),
      "intrinsics of depth images that are not registered to colour [px]: depth is moved into the "
      "colour images; default: those of the recording; where it has none, depth is registered, or "
      "shows the same view in another size");
  add("depth-to-color", po::value<std::string>()->value_name("FILE|TX,TY,TZ[,QX,QY,QZ,QW]"),
      "where the depth camera is in the frame of the colour camera [m]: a text file with a matrix "
      "of 4x4, or numbers; default: that of the recording, or the same place");
  add("depth-scale", po::value<double>()->value_name("UNITS"),
      "units of the depth images per metre; default: that of the format (TUM 5000, most "
      "others 1000)");
  add("max-time-difference",
      po::value(&dataset.max_time_difference)->value_name("S")->default_value(0.02, "0.02"),
      "largest time between the colour and the depth image of a frame [s], where images are paired "
      "by time");
  add("stride", po::value(&dataset.stride)->value_name("N")->default_value(1),
      "take every N-th frame");
  add("max-frames", po::value(&dataset.max_frames)->value_name("N")->default_value(0),
      "take at most N frames of each SCAN, 0 = all");
  add("sensor", po::value<std::string>()->value_name("NAME|FILE")->default_value("kinect"),
      "depth sensor, which sets the noise: kinect (structured light), d400 (active stereo), tof, "
      "lidar or a JSON file {\"constant\": C, \"quadratic\": Q, \"offset\": O}: standard deviation "
      "C + Q (z - O)^2 of a depth z [m]");
  add("no-mask", "ignore the recording's folder mask/ or masks/; default: pixels that are 0 in a "
                 "frame's mask are left out");
  add("shuffle", po::value<std::uint64_t>()->value_name("SEED"),
      "take the frames in random order; the methods bundle_icp and rgbd_sfm give the same result "
      "in any order");
  return options;
}

/** Boost reads "-1" for an unsigned number as a huge number. */
inline void
refuseNegativeNumbers(const boost::program_options::parsed_options& parsed)
{
  for (const auto& option : parsed.options)
    for (const char* const name : {"stride", "max-frames", "decimate"})
      if (option.string_key == name && !option.value.empty() && option.value[0][0] == '-')
        throw UsageError(std::string("--") + name + " " + option.value[0] +
                         ": must not be negative");
}

/** Takes what the options say of the camera of depth. */
inline void
takeDepthCamera(const boost::program_options::variables_map& values, DatasetOptions& dataset)
{
  if (values.count("depth-intrinsics")) {
    const std::string text = values["depth-intrinsics"].as<std::string>();
    try {
      dataset.depth_intrinsics = parseIntrinsics(text);
    }
    catch (const pcl::BadArgumentException&) {
      throw UsageError("--depth-intrinsics " + text + ": expected fx,fy,cx,cy[,k1,k2,p1,p2,k3]");
    }
  }
  if (values.count("depth-to-color"))
    dataset.color_from_depth = readDepthToColor(values["depth-to-color"].as<std::string>());
}

/** Applies the options that describeRecording() does not store. */
inline void
applyRecording(const boost::program_options::variables_map& values, DatasetOptions& dataset)
{
  if (values.count("intrinsics") && values["intrinsics"].as<std::string>() == "estimate")
    dataset.field_of_view = IntrinsicsEstimateOptions().field_of_view;
  else if (values.count("intrinsics")) {
    try {
      dataset.intrinsics = parseIntrinsics(values["intrinsics"].as<std::string>());
    }
    catch (const pcl::BadArgumentException& error) {
      throw UsageError(error.what());
    }
  }
  takeDepthCamera(values, dataset);
  dataset.use_masks = !values.count("no-mask");
  if (values.count("depth-scale"))
    dataset.depth_scale = values["depth-scale"].as<double>();
  dataset.depth_noise = readDepthNoise(values["sensor"].as<std::string>());
  if (values.count("shuffle"))
    dataset.shuffle_seed = values["shuffle"].as<std::uint64_t>();
  std::string error;
  if (!dataset.isValid(&error))
    throw UsageError(error);
}

/** Opens a recording; its intrinsics are estimated where the options say so. */
inline RGBDDataset::Ptr
openRecording(const std::string& scan, const DatasetOptions& options)
{
  return options.field_of_view ? openWithEstimatedIntrinsics(scan, options)
                               : openDataset(scan, options);
}

/** Parses the `visible` options and at most `max_scans` scans without an option name.
 *  \param print_help is called when the user asks for help; the result is then unset
 *  \param[out] scans a string or a vector of strings */
template <class Scans, class PrintHelp>
std::optional<boost::program_options::variables_map>
parseScanArguments(int argc, char** argv,
                   const boost::program_options::options_description& visible, int max_scans,
                   Scans& scans, const PrintHelp& print_help)
{
  namespace po = boost::program_options;
  po::options_description all;
  all.add(visible).add_options()("scan", po::value(&scans));
  po::positional_options_description positional;
  positional.add("scan", max_scans);
  const po::parsed_options parsed =
      po::command_line_parser(argc, argv).options(all).positional(positional).run();
  refuseNegativeNumbers(parsed);
  po::variables_map values;
  po::store(parsed, values);
  if (values.count("help")) {
    print_help(visible);
    return std::nullopt;
  }
  po::notify(values);
  return values;
}

} // namespace bundle_icp

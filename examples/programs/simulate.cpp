// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
//
// Writes a synthetic hand-held scan, with exact poses and surface.
#include "program.h"

#include <bundle_icp/simulation/synthetic_scan.h>

#include <boost/program_options.hpp>

#include <functional>
#include <iostream>
#include <optional>
#include <regex>
#include <sstream>

namespace po = boost::program_options;
using namespace bundle_icp;

namespace {

struct Arguments {
  std::string folder, size = "640x480", depth_size, depth_offset;
  SyntheticScanOptions scan;
  SyntheticScanWriteOptions write;
  bool is_noisy = false, is_quiet = false;
  bool gripper = false, person = false, still = false, turntable = false;
};

/** An option with its unit and the default that `target` holds. */
template <typename T>
po::typed_value<T>*
valueOf(T& target, const char* unit)
{
  std::ostringstream text;
  text << target;
  return po::value(&target)->value_name(unit)->default_value(target, text.str());
}

/** An option for one fault. Without the option `target` does not change. */
template <typename T>
po::typed_value<T>*
faultOf(T& target, const char* unit)
{
  return po::value<T>()->value_name(unit)->notifier([&target](T value) { target = value; });
}

po::options_description
describeScan(Arguments& arguments)
{
  SyntheticScanOptions& scan = arguments.scan;
  po::options_description options("Scan");
  auto add = options.add_options();
  add("help,h", "print this text");
  add("version", "print the version");
  add("format", valueOf(arguments.write.format, "NAME"),
      ("format of the recording: " + syntheticScanFormats()).c_str());
  add("frames", valueOf(scan.num_frames, "N"), "number of frames");
  add("rate", valueOf(scan.frame_rate, "HZ"),
      "frames per second on the path; a longer scan goes on through the room");
  add("size", valueOf(arguments.size, "WxH"), "size of the images [px]");
  add("focal-length", valueOf(scan.focal_length, "PX"), "true focal length [px]");
  add("depth-size", po::value(&arguments.depth_size)->value_name("WxH"),
      "size of the depth images [px], seen by a camera of their own: recorded as they are, not "
      "registered to colour; default: that of colour");
  add("depth-focal-length", po::value(&scan.depth_focal_length)->value_name("PX"),
      "focal length of the depth camera [px]; default: as wide a view as that of colour");
  add("depth-offset", po::value(&arguments.depth_offset)->value_name("X,Y,Z"),
      "where the depth camera is in the frame of the colour camera [m]; default: the same place");
  add("seed", valueOf(scan.seed, "N"), "seed of textures, path and faults");
  add("start", valueOf(scan.start_time, "S"),
      "start of the scan on the path [s]: objects on a table first, the walls from 67 s on");
  add("movement", valueOf(scan.movement, "SHARE"),
      "share of the path's translation, 0 = turning on the spot");
  add("texture", valueOf(scan.texture, "SHARE"),
      "contrast of all surfaces, 0 = each in one colour");
  add("gripper", po::bool_switch(&arguments.gripper),
      "a robot's gripper, fixed to the camera, in the lower third of the image");
  add("person", po::bool_switch(&arguments.person), "a person who walks around the table");
  add("still", po::bool_switch(&arguments.still),
      "the camera stays where the path starts, as on a tripod");
  add("turntable", po::bool_switch(&arguments.turntable),
      "a camera that stands still, and before it things on a turntable, which turns by 30 degrees "
      "a second; groundtruth.txt and surface.ply are those of the things");
  add("masks", po::bool_switch(&arguments.write.masks),
      "also mask/, a mask of each frame, 0 where gripper or person are");
  add("surface-spacing", valueOf(arguments.write.surface_spacing, "M"),
      "distance of the points in surface.ply [m]; 0 = no such file");
  add("threads", valueOf(arguments.write.num_threads, "N"), "threads, 0 = all");
  add("quiet,q", po::bool_switch(&arguments.is_quiet), "no progress");
  return options;
}

po::options_description
describeFaults(Arguments& arguments)
{
  SyntheticScanOptions& scan = arguments.scan;
  po::options_description options(
      "Faults of the camera; a single fault takes precedence over --full-noise");
  auto add_noise = options.add_options();
  add_noise("full-noise", po::bool_switch(&arguments.is_noisy),
            "the faults of a common structured-light camera: --noise 1 --quantisation 0.0028 "
            "--holes 0.05 --flying-pixels --color-noise 2 --blur 0.05 --exposure-change 0.15");
  add_noise("noise", faultOf(scan.noise_factor, "FACTOR"),
            "depth noise as a multiple of 0.0012 m + 0.0019 /m (z - 0.4 m)^2; range 0.4 to 5 m; "
            "default 0");
  add_noise("quantisation", faultOf(scan.quantisation, "STEP"),
            "steps of depth as a multiple of z^2 [1/m]; default 0");
  add_noise("holes", faultOf(scan.hole_fraction, "SHARE"),
            "share of pixels without depth, 0 to 0.95; default 0");
  add_noise("flying-pixels",
            po::value<bool>()->implicit_value(true)->zero_tokens()->notifier(
                [&scan](bool value) { scan.flying_pixels = value; }),
            "mixed depth at occlusion edges; default off");
  add_noise("color-noise", faultOf(scan.color_noise, "LEVELS"),
            "standard deviation of colour [levels of 255]; default 0");
  add_noise("blur", faultOf(scan.blur_fraction, "SHARE"),
            "share of frames with motion blur, 0 to 1; default 0");
  add_noise("exposure-change", faultOf(scan.exposure_change, "SHARE"),
            "relative amplitude of changes of brightness, 0 to 0.9; default 0");
  add_noise("depth-bias", faultOf(scan.depth_bias, "BIAS"),
            "measured depth is z (1 + BIAS z) [1/m]; default 0");
  add_noise("focal-error", faultOf(scan.focal_error, "SHARE"),
            "relative error of the focal length in intrinsics.txt; default 0");
  add_noise("time-offset", faultOf(scan.time_offset, "S"),
            "time from colour to depth [s]; default 0");
  add_noise("readout", faultOf(scan.readout, "S"),
            "rolling shutter of colour: time from the first to the last row [s], -0.1 to 0.1; "
            "the stamp is that of the middle row; default 0");
  add_noise("unordered", po::bool_switch(&scan.unordered),
            "frames in random order, with stamps that tell nothing");
  return options;
}

void
parseSize(const std::string& option, const std::string& text, int& width, int& height)
{
  std::smatch match;
  if (!std::regex_match(text, match, std::regex("([0-9]{1,5})x([0-9]{1,5})")))
    throw UsageError("--" + option + " " + text + ": expected WxH, for example 640x480");
  width = std::stoi(match[1]);
  height = std::stoi(match[2]);
}

Eigen::Vector3d
parseOffset(const std::string& text)
{
  std::istringstream stream(text);
  Eigen::Vector3d offset;
  char first = 0, second = 0;
  if (!(stream >> offset.x() >> first >> offset.y() >> second >> offset.z()) || first != ',' ||
      second != ',' || stream.peek() != EOF)
    throw UsageError("--depth-offset " + text + ": expected X,Y,Z [m], for example 0.02,0,0");
  return offset;
}

/** \return nothing when the user asked for help. */
std::optional<Arguments>
parse(int argc, char** argv)
{
  Arguments arguments;
  po::options_description visible, all;
  visible.add(describeScan(arguments)).add(describeFaults(arguments));
  all.add(visible).add_options()("folder", po::value(&arguments.folder));
  po::positional_options_description positional;
  positional.add("folder", 1);
  po::variables_map values;
  po::store(po::command_line_parser(argc, argv).options(all).positional(positional).run(), values);
  if (values.count("help")) {
    std::cout << "Usage: bundle_icp_simulate OUT [options]\n\n"
                 "Writes a synthetic hand-held RGB-D scan of a room to the new or empty folder\n"
                 "OUT: a recording in TUM format (or that of --format) with exact poses\n"
                 "(groundtruth.txt) and points of the true surface (surface.ply).\n"
              << visible;
    return std::nullopt;
  }
  // Comes before the single faults are stored, so that they take precedence.
  if (values["full-noise"].as<bool>())
    arguments.scan = SyntheticScanOptions::fullNoise();
  po::notify(values);
  arguments.scan.gripper = arguments.gripper;
  arguments.scan.person = arguments.person;
  arguments.scan.still = arguments.still;
  arguments.scan.turntable = arguments.turntable;
  if (arguments.folder.empty())
    throw UsageError("expected a folder OUT");
  SyntheticScanOptions& scan = arguments.scan;
  parseSize("size", arguments.size, scan.width, scan.height);
  if (!arguments.depth_size.empty())
    parseSize("depth-size", arguments.depth_size, scan.depth_width, scan.depth_height);
  if (!arguments.depth_offset.empty())
    scan.depth_offset = parseOffset(arguments.depth_offset);
  std::string error;
  if (!scan.isValid(&error) || !arguments.write.isValid(&error))
    throw UsageError(error);
  return arguments;
}

int
simulate(int argc, char** argv)
{
  const std::optional<Arguments> arguments = parse(argc, argv);
  if (!arguments)
    return 0;
  const SyntheticScan scan(arguments->scan);
  ProgressPrinter progress(arguments->is_quiet);
  writeSyntheticScan(scan, arguments->folder, arguments->write, std::ref(progress));
  return 0;
}

} // namespace

int
main(int argc, char** argv)
{
  return runProgram("bundle_icp_simulate", simulate, argc, argv);
}

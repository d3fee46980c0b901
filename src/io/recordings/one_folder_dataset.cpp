// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// Colour and depth images in one folder, told apart by the words in their names.
#include "io/recordings/calibration_files.h"
#include "io/recordings/image_streams.h"

#include <boost/algorithm/string.hpp>
#include <boost/filesystem.hpp>

namespace bundle_icp {

namespace fs = boost::filesystem;

namespace {

bool
namesAny(const StreamImage& image, std::initializer_list<const char*> words)
{
  const std::string name = boost::to_lower_copy(fs::path(image.file).stem().string());
  return std::any_of(words.begin(), words.end(),
                     [&name](const char* word) { return boost::contains(name, word); });
}

struct Streams {
  Stream color, depth;
};

/** The images of a folder that name a kind; where none names colour, those that name nothing. */
Streams
readStreams(const std::string& folder)
{
  Streams streams;
  Stream unnamed;
  for (const StreamImage& image : listImages(folder)) {
    if (namesAny(image, {"depth"}))
      streams.depth.push_back(image);
    else if (namesAny(image, {"color", "colour", "rgb"}))
      streams.color.push_back(image);
    else if (!namesAny(image, {"mask", "confidence", "normal", "label", "semantic", "instance"}))
      unnamed.push_back(image);
  }
  if (streams.color.empty())
    streams.color = unnamed;
  return streams;
}

bool
holdsImages(const std::string& folder)
{
  const fs::directory_iterator entries(folder);
  return std::any_of(begin(entries), end(entries), [](const fs::directory_entry& entry) {
    return isImageName(entry.path().filename().string());
  });
}

} // namespace

bool
isOneFolder(const std::string& folder)
{
  if (!holdsImages(folder))
    return false;
  const Streams streams = readStreams(folder);
  return !streams.color.empty() && !streams.depth.empty();
}

Recording
readOneFolder(const std::string& folder, const DatasetOptions& options)
{
  Recording recording;
  recording.format = "images in one folder";
  recording.depth_scale = 1000;
  recording.depth_scale_source = "the format (images in one folder)";
  const Streams streams = readStreams(folder);
  pairImages(streams.color, streams.depth, options, folder, recording);
  readCalibrationFile(folder, recording);
  return recording;
}

} // namespace bundle_icp

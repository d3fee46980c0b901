// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/recordings/confidence.h"

#include "io/image_file.h"

#include <boost/filesystem.hpp>

#include <map>

namespace bundle_icp {

namespace fs = boost::filesystem;

namespace {

/** Image files with an image of the confidence of depth. */
class ConfidentImages : public FrameReader {
public:
  /** \param confidence_of file of the confidence by that of depth */
  explicit ConfidentImages(std::map<std::string, std::string> confidence_of)
  : confidence_of_(std::move(confidence_of))
  {
  }

  ImagePair
  read(const RecordedFrame& frame) const override
  {
    ImagePair images{readColorImage(frame.color_file), readDepthImage(frame.depth_file)};
    const auto found = confidence_of_.find(frame.depth_file);
    if (found == confidence_of_.end())
      return images;
    const cv::Mat confidence = readAnyImage(found->second);
    if (confidence.size() != images.depth.size() || confidence.channels() != 1)
      throw UnsuitableImage(found->second + ": the confidence must have one channel, and the size "
                                            "of the depth image");
    images.depth.setTo(0, confidence == 0);
    return images;
  }

private:
  std::map<std::string, std::string> confidence_of_;
};

} // namespace

void
useConfidence(const std::string& confidence_folder, Recording& recording)
{
  std::map<std::string, std::string> confidence_of;
  for (const RecordedFrame& frame : recording.frames) {
    const fs::path file = fs::path(confidence_folder) / fs::path(frame.depth_file).filename();
    if (!fs::exists(file))
      continue;
    confidence_of.emplace(frame.depth_file, file.string());
    recording.other_files.push_back(file.string());
  }
  if (confidence_of.empty())
    return;
  recording.findings.push_back({Severity::NOTE,
                                "confidence",
                                "depth of the lowest confidence is left out, in " +
                                    std::to_string(confidence_of.size()) + " of " +
                                    std::to_string(recording.frames.size()) + " frames",
                                {{"frames", double(confidence_of.size())}},
                                ""});
  recording.reader = std::make_shared<ConfidentImages>(std::move(confidence_of));
}

} // namespace bundle_icp

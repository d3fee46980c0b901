// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/stored_frames.h"

#include "common/archive.h"
#include "scan/check_images.h"
#include "scan/settings_hash.h"

#include <boost/filesystem.hpp>

#include <map>

namespace bundle_icp {
namespace {

/** The name of a frame from the folder of its recording on, so that a recording may be moved. */
std::string
nameIn(std::string recording, const std::string& name)
{
  recording.erase(recording.find_last_not_of('/') + 1);
  const std::string folder = recording + "/";
  if (recording.empty() || name.compare(0, folder.size(), folder) != 0)
    return name;
  namespace fs = boost::filesystem;
  const fs::path place = fs::absolute(recording).lexically_normal();
  const fs::path last = place.filename() == "." ? place.parent_path().filename() : place.filename();
  return last.string() + "/" + name.substr(name.find_first_not_of('/', folder.size() - 1));
}

/** Frames of one name are told apart by their number. */
std::vector<std::string>
namesOf(const RGBDDataset& dataset)
{
  std::vector<std::string> names;
  std::map<std::string, std::size_t> times;
  for (std::size_t i = 0; i < dataset.size(); ++i) {
    names.push_back(nameIn(dataset.recording(i), dataset.name(i)));
    if (const std::size_t before = times[names.back()]++; before > 0)
      names.back() += "#" + std::to_string(before);
  }
  return names;
}

} // namespace

StoredFrames::StoredFrames(const RGBDDataset& dataset, const ReconstructionOptions& options)
: database_(options.database->path, options.database->fresh), camera_(dataset.camera()),
  feature_settings_(settingsHash(options.features, dataset.camera())),
  match_settings_(settingsHash(options.graph.matching)), names_(namesOf(dataset)),
  images_(dataset.size()), contents_(dataset.size())
{
  for (const std::string& source : options.database->sources) {
    ScanDatabase other(source, false);
    database_.takeFrom(other);
  }
}

std::optional<Features>
StoredFrames::features(std::size_t frame, const RGBDFrame& rgbd)
{
  std::uint64_t parts[] = {hashOf(rgbd.color), hashOf(rgbd.depth), feature_settings_};
  contents_[frame] = hashOf(cv::Mat(1, 3, CV_64F, parts));
  images_[frame] = database_.image(names_[frame], contents_[frame], camera_);
  std::optional<Features> features = database_.features(images_[frame]);
  reused_features_ += features.has_value();
  return features;
}

void
StoredFrames::addFeatures(std::size_t frame, const Features& features)
{
  database_.addFeatures(images_[frame], features);
}

std::optional<FramePair>
StoredFrames::find(std::size_t first, std::size_t second)
{
  std::optional<FramePair> pair =
      database_.pair(imageOfNode(first), imageOfNode(second), match_settings_);
  reused_pairs_ += pair.has_value();
  return pair;
}

void
StoredFrames::add(const FramePair& pair)
{
  database_.addPair(imageOfNode(pair.first), imageOfNode(pair.second), match_settings_, pair,
                    camera_);
}

std::unique_ptr<StoredMap>
StoredFrames::map(const ImageGraph& graph, std::uint64_t settings)
{
  std::string nodes;
  for (std::size_t node = 0; node < graph.size(); ++node) {
    const PosePrior prior = graph.prior(node).value_or(PosePrior());
    nodes += toArchive(contents_[frame_of_node_[node]], graph.timestamp(node),
                       graph.prior(node).has_value(), prior.world_from_camera, prior.position_sigma,
                       prior.rotation_sigma);
  }
  return std::make_unique<StoredMap>(database_,
                                     settingsHash(toArchive(settings, match_settings_, nodes)));
}

} // namespace bundle_icp

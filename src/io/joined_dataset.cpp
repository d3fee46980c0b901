// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/io/joined_dataset.h>

#include "io/frame_resampler.h"
#include "io/recordings/time_stamps.h"

#include <bundle_icp/common/exceptions.h>

#include <algorithm>
#include <set>
#include <utility>

namespace bundle_icp {
namespace {

bool
areSame(const DepthNoise& a, const DepthNoise& b)
{
  return a.constant == b.constant && a.quadratic == b.quadratic && a.offset == b.offset;
}

/** Whether images of two cameras have their rays at the same pixels. */
bool
haveSameRays(const CameraIntrinsics& a, const CameraIntrinsics& b)
{
  return a.width == b.width && a.height == b.height && a.fx == b.fx && a.fy == b.fy &&
         a.cx == b.cx && a.cy == b.cy;
}

/** First and last stamp of a recording [s]. */
std::pair<double, double>
timesOf(const RGBDDataset& recording)
{
  std::pair<double, double> times{recording.timestamp(0), recording.timestamp(0)};
  for (std::size_t i = 1; i < recording.size(); ++i) {
    times.first = std::min(times.first, recording.timestamp(i));
    times.second = std::max(times.second, recording.timestamp(i));
  }
  return times;
}

bool
overlapInTime(const std::vector<RGBDDataset::Ptr>& recordings)
{
  std::vector<std::pair<double, double>> times;
  for (const RGBDDataset::Ptr& recording : recordings)
    times.push_back(timesOf(*recording));
  std::sort(times.begin(), times.end());
  for (std::size_t i = 1; i < times.size(); ++i)
    if (times[i].first <= times[i - 1].second)
      return true;
  return false;
}

/** At one Unix time a camera is at one place, whatever recording says so. */
bool
haveOneClock(const std::vector<RGBDDataset::Ptr>& recordings)
{
  std::set<double> stamps;
  for (const RGBDDataset::Ptr& recording : recordings)
    for (std::size_t i = 0; i < recording->size(); ++i)
      if (!isUnixTime(recording->timestamp(i)) || !stamps.insert(recording->timestamp(i)).second)
        return false;
  return true;
}

} // namespace

JoinedDataset::JoinedDataset(std::vector<RGBDDataset::Ptr> recordings)
: recordings_(std::move(recordings))
{
  if (recordings_.empty())
    throw BadArgumentException("JoinedDataset: there are no recordings");
  for (const RGBDDataset::Ptr& recording : recordings_)
    if (!recording || recording->size() == 0)
      throw BadArgumentException("JoinedDataset: a recording is null or has no frames");
  for (const RGBDDataset::Ptr& recording : recordings_)
    if (!areSame(recording->camera().depth_noise, camera().depth_noise))
      throw BadArgumentException(recording->name(0) + " and " + recordings_.front()->name(0) +
                                 ": recordings of depth sensors with other noise cannot be joined; "
                                 "give one that holds for all (--sensor)");
  for (const RGBDDataset::Ptr& recording : recordings_) {
    resamplers_.emplace_back();
    if (!haveSameRays(recording->camera(), camera()))
      resamplers_.back() = std::make_shared<FrameResampler>(recording->camera(), camera());
  }
  for (std::size_t r = 0; r < recordings_.size(); ++r)
    for (std::size_t i = 0; i < recordings_[r]->size(); ++i)
      places_.push_back({r, i});
  are_ordered_ = std::all_of(recordings_.begin(), recordings_.end(),
                             [](const auto& recording) { return recording->isOrdered(); });
  overlap_ = overlapInTime(recordings_) && !haveOneClock(recordings_);
}

std::size_t
JoinedDataset::size() const
{
  return places_.size();
}

const CameraIntrinsics&
JoinedDataset::camera() const
{
  return recordings_.front()->camera();
}

std::size_t
JoinedDataset::id(std::size_t index) const
{
  return at(index).id(places_[index].index);
}

double
JoinedDataset::timestamp(std::size_t index) const
{
  return at(index).timestamp(places_[index].index);
}

std::string
JoinedDataset::name(std::size_t index) const
{
  return at(index).name(places_[index].index);
}

RGBDFrame
JoinedDataset::read(std::size_t index) const
{
  const RGBDFrame frame = at(index).read(places_[index].index);
  const auto& resampler = resamplers_[places_[index].recording];
  return resampler ? (*resampler)(frame) : frame;
}

std::string
JoinedDataset::recording(std::size_t index) const
{
  return at(index).recording(places_[index].index);
}

bool
JoinedDataset::isOrdered() const
{
  return are_ordered_ && !overlap_;
}

bool
JoinedDataset::hasTimes() const
{
  return std::all_of(recordings_.begin(), recordings_.end(),
                     [](const auto& recording) { return recording->hasTimes(); });
}

std::string
JoinedDataset::format() const
{
  std::vector<std::string> formats;
  for (const RGBDDataset::Ptr& recording : recordings_)
    if (std::find(formats.begin(), formats.end(), recording->format()) == formats.end())
      formats.push_back(recording->format());
  std::string text;
  for (const std::string& format : formats)
    text += (text.empty() ? "" : ", ") + format;
  return text;
}

Trajectory
JoinedDataset::groundTruth() const
{
  return recordings_.size() == 1 ? recordings_.front()->groundTruth() : Trajectory();
}

std::optional<PosePrior>
JoinedDataset::prior(std::size_t index) const
{
  return recordings_.size() == 1 ? recordings_.front()->prior(index) : std::nullopt;
}

std::vector<Finding>
JoinedDataset::findings() const
{
  std::vector<Finding> all = ownFindings();
  for (const RGBDDataset::Ptr& recording : recordings_)
    for (const Finding& finding : recording->findings())
      if (std::none_of(all.begin(), all.end(), [&finding](const Finding& other) {
            return other.kind == finding.kind && other.what == finding.what;
          }))
        all.push_back(finding);
  return all;
}

std::vector<Finding>
JoinedDataset::ownFindings() const
{
  std::vector<Finding> findings;
  if (overlap_)
    findings.push_back({Severity::NOTE,
                        "recordings",
                        std::to_string(recordings_.size()) +
                            " recordings are joined; their time stamps overlap, so that nothing is "
                            "concluded from time",
                        {{"recordings", double(recordings_.size())}},
                        ""});
  const auto resampled = std::count_if(resamplers_.begin(), resamplers_.end(),
                                       [](const auto& resampler) { return bool(resampler); });
  if (resampled > 0)
    findings.push_back({Severity::NOTE,
                        "cameras",
                        std::to_string(resampled) + " of " + std::to_string(recordings_.size()) +
                            " recordings are of another camera than the first; their images are "
                            "resampled to it, and one calibration is estimated for all",
                        {{"resampled", double(resampled)}},
                        ""});
  return findings;
}

std::vector<SkippedFile>
JoinedDataset::skipped() const
{
  std::vector<SkippedFile> all;
  for (const RGBDDataset::Ptr& recording : recordings_) {
    const std::vector<SkippedFile> some = recording->skipped();
    all.insert(all.end(), some.begin(), some.end());
  }
  return all;
}

} // namespace bundle_icp

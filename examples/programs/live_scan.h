// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
//
// bundle_icp_reconstruct --live: a recording played by its stamps, as a camera would give it.
#pragma once

#include <bundle_icp/common/exceptions.h>
#include <bundle_icp/scan/scan_session.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <exception>
#include <iostream>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

namespace bundle_icp {

/** A camera that plays a recording by its stamps. One frame at most waits to be taken; another one
 *  takes its place. */
class PlayedCamera {
public:
  explicit PlayedCamera(const RGBDDataset& dataset) : dataset_(dataset), thread_([this] { play(); })
  {
  }
  ~PlayedCamera()
  {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      ends_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }
  PlayedCamera(const PlayedCamera&) = delete;
  PlayedCamera&
  operator=(const PlayedCamera&) = delete;

  /** The next frame, with its index in the recording; waits for it. Unset at the end. */
  std::optional<std::pair<std::size_t, RGBDFrame>>
  grab()
  {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait(lock, [this] { return waiting_ || ended_; });
    if (failure_)
      std::rethrow_exception(failure_);
    return std::exchange(waiting_, std::nullopt);
  }

  /** Frames that nobody took in time, and those that could not be read. */
  std::size_t
  dropped() const
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    return dropped_;
  }

private:
  void
  play()
  {
    try {
      playFrames();
    }
    catch (...) {
      const std::lock_guard<std::mutex> lock(mutex_);
      failure_ = std::current_exception();
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    ended_ = true;
    changed_.notify_all();
  }

  void
  playFrames()
  {
    using Clock = std::chrono::steady_clock;
    std::optional<Clock::time_point> start;
    for (std::size_t i = 0; i < dataset_.size(); ++i) {
      std::optional<RGBDFrame> frame;
      try {
        frame = dataset_.read(i);
      }
      catch (const pcl::IOException&) { // as one that the camera did not give
      }
      if (!start) // the first one is there
        start = Clock::now();
      const std::chrono::duration<double> due(dataset_.timestamp(i) - dataset_.timestamp(0));
      std::unique_lock<std::mutex> lock(mutex_);
      changed_.wait_until(lock, *start + std::chrono::duration_cast<Clock::duration>(due),
                          [this] { return ends_; });
      if (ends_)
        return;
      dropped_ += !frame || waiting_;
      if (frame)
        waiting_.emplace(i, std::move(*frame));
      changed_.notify_all();
    }
  }

  const RGBDDataset& dataset_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<std::pair<std::size_t, RGBDFrame>> waiting_;
  std::size_t dropped_ = 0;
  bool ends_ = false, ended_ = false;
  std::exception_ptr failure_;
  std::thread thread_;
};

/** The frames of a recording that were played. */
class PlayedFrames : public RGBDDataset {
public:
  PlayedFrames(RGBDDataset::Ptr all, std::vector<std::size_t> played)
  : all_(std::move(all)), played_(std::move(played))
  {
  }
  std::size_t
  size() const override
  {
    return played_.size();
  }
  const CameraIntrinsics&
  camera() const override
  {
    return all_->camera();
  }
  std::size_t
  id(std::size_t index) const override
  {
    return all_->id(played_[index]);
  }
  double
  timestamp(std::size_t index) const override
  {
    return all_->timestamp(played_[index]);
  }
  std::string
  name(std::size_t index) const override
  {
    return all_->name(played_[index]);
  }
  std::string
  recording(std::size_t index) const override
  {
    return all_->recording(played_[index]);
  }
  RGBDFrame
  read(std::size_t index) const override
  {
    return all_->read(played_[index]);
  }
  std::string
  format() const override
  {
    return all_->format();
  }
  std::vector<Finding>
  findings() const override
  {
    return all_->findings();
  }
  std::vector<SkippedFile>
  skipped() const override
  {
    return all_->skipped();
  }

private:
  const RGBDDataset::Ptr all_;
  const std::vector<std::size_t> played_; ///< indices in the recording
};

/** What was played. */
struct LiveFigures {
  std::vector<std::size_t> played; ///< indices in the recording
  std::size_t dropped = 0, doubtful = 0, lost = 0, by_features = 0;
  std::vector<double> milliseconds; ///< of each addFrame()

  /** Share 0.5 = median. */
  double
  percentile(double share) const
  {
    std::vector<double> sorted = milliseconds;
    std::sort(sorted.begin(), sorted.end());
    return sorted.empty() ? 0 : sorted[std::size_t(share * double(sorted.size() - 1) + 0.5)];
  }
};

/** Plays a recording through a session. \param progress of the frames; false stops */
inline LiveFigures
playLive(const RGBDDataset& dataset, ScanSession& session, const ProgressCallback& progress)
{
  LiveFigures figures;
  PlayedCamera camera(dataset);
  while (const auto frame = camera.grab()) {
    const auto start = std::chrono::steady_clock::now();
    const LivePose pose = session.addFrame(frame->second);
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
    figures.milliseconds.push_back(1000 * seconds.count());
    figures.played.push_back(frame->first);
    figures.doubtful += pose.status == LiveStatus::DOUBTFUL;
    figures.lost += pose.status == LiveStatus::LOST;
    figures.by_features += pose.by_features;
    if (!progress({"live", frame->first + 1, dataset.size()}))
      break;
  }
  figures.dropped = camera.dropped();
  return figures;
}

inline void
printLiveFigures(const LiveFigures& figures)
{
  std::cout << "live: " << figures.played.size() << " frames played, " << figures.dropped
            << " dropped, " << figures.lost << " lost, " << figures.doubtful << " doubtful; "
            << std::round(10 * figures.percentile(0.5)) / 10 << " ms a frame (median), "
            << std::round(10 * figures.percentile(0.99)) / 10 << " ms (99 %)"
            << std::endl; // what follows takes long
}

/** The result of a session that a recording is played through, with its figures printed.
 *  \param dataset becomes that of the frames that were played */
inline ReconstructionResult
reconstructLive(RGBDDataset::Ptr& dataset, const ReconstructionOptions& options,
                const ProgressCallback& progress)
{
  ScanSessionOptions session_options;
  session_options.reconstruction = options;
  ScanSession session(dataset->camera(), session_options);
  const LiveFigures figures = playLive(*dataset, session, progress);
  printLiveFigures(figures);
  if (figures.played.empty())
    throw IOException("no frame of the recording could be read");
  std::vector<Finding> findings = dataset->findings();
  dataset = std::make_shared<PlayedFrames>(dataset, figures.played);
  ReconstructionResult result = session.finish(progress);
  for (std::size_t i = 0; i < result.frames.size(); ++i) {
    result.frames[i].id = dataset->id(i);
    result.frames[i].name = dataset->name(i);
  }
  result.findings.insert(result.findings.begin(), findings.begin(), findings.end());
  return result;
}

} // namespace bundle_icp

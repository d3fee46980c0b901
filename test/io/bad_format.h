// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/io/rgbd_dataset.h>
#include <bundle_icp/simulation/synthetic_scan.h>

#include "messages.h"
#include "recordings.h"

#include <gtest/gtest.h>
#include <pcl/exceptions.h>

#include <optional>

/** Recordings of the formats that bundle_icp_simulate writes, for tests that damage them. */
namespace bad_format {

inline std::string
openError(const std::string& path)
{
  return messageOf<pcl::IOException>([&] { bundle_icp::openDataset(path); });
}

/** Replaces a part of a text file. */
inline void
replace(const std::string& path, const std::string& part, const std::string& by)
{
  std::string text = readText(path);
  const std::size_t at = text.find(part);
  ASSERT_NE(at, std::string::npos) << path << " has no " << part;
  writeText(path, text.replace(at, part.size(), by));
}

/** The first finding of a kind whose sentence holds a text. */
inline std::optional<bundle_icp::Finding>
findingOf(const bundle_icp::RGBDDataset& dataset, const std::string& kind, const std::string& text)
{
  for (const bundle_icp::Finding& finding : dataset.findings())
    if (finding.kind == kind && finding.what.find(text) != std::string::npos)
      return finding;
  return std::nullopt;
}

class BadFormat : public ::testing::Test {
protected:
  /** Writes a scan of three frames. */
  void
  write(const std::string& format)
  {
    bundle_icp::SyntheticScanOptions scan;
    scan.num_frames = 3;
    scan.width = 64;
    scan.height = 48;
    scan.focal_length = 55;
    bundle_icp::SyntheticScanWriteOptions options;
    options.format = format;
    options.surface_spacing = 0;
    options.num_threads = 1;
    bundle_icp::writeSyntheticScan(bundle_icp::SyntheticScan(scan), place, options);
  }

  TemporaryFolder folder;
  std::string place = folder.path("scan");
};

/** Opens a recording and reads all of it; faults may be refused, and nothing else may happen. */
inline void
readAll(const std::string& path)
{
  try {
    const auto dataset = bundle_icp::openDataset(path);
    for (std::size_t i = 0; i < dataset->size(); ++i)
      try {
        dataset->read(i);
      }
      catch (const pcl::IOException&) {
      }
  }
  catch (const pcl::IOException&) {
  }
  catch (const pcl::BadArgumentException&) { // impossible intrinsics
  }
}

/** Cuts a file off at many places, and changes bytes of it at random. */
inline void
damage(const std::string& recording, const std::string& file)
{
  const std::string whole = readText(file);
  for (std::size_t size = 0; size < whole.size(); size += 1 + whole.size() / 40) {
    writeText(file, whole.substr(0, size));
    readAll(recording);
  }
  cv::RNG random(1);
  for (int repetition = 0; repetition < 150; ++repetition) {
    std::string damaged = whole;
    // Half of the changes are where sizes stand.
    const int range = repetition % 2 ? int(whole.size()) : std::min(600, int(whole.size()));
    for (int k = random.uniform(1, 4); k > 0; --k)
      damaged[std::size_t(random.uniform(0, range))] = char(random.uniform(0, 256));
    writeText(file, damaged);
    readAll(recording);
  }
  writeText(file, whole);
  readAll(recording);
}

} // namespace bad_format

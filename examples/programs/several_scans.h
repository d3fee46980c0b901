// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
//
// Several recordings as one scan.
#pragma once

#include <boost/filesystem.hpp>
#include <nlohmann/json.hpp>
#include <pcl/exceptions.h>

#include <algorithm>
#include <fstream>
#include <set>
#include <string>
#include <vector>

namespace bundle_icp {

/** The recordings that the result in a folder was made from. */
inline std::vector<std::string>
recordingsOfResult(const std::string& folder)
{
  const std::string path = (boost::filesystem::path(folder) / "report.json").string();
  std::ifstream file(path);
  if (!file)
    throw pcl::IOException(path + ": cannot be opened; an earlier result is needed");
  const auto json = nlohmann::json::parse(file, nullptr, false);
  try {
    return json.at("dataset").at("recordings").get<std::vector<std::string>>();
  }
  catch (const nlohmann::json::exception&) {
    throw pcl::IOException(path + ": names no recordings that could be added to");
  }
}

/** A recording joined with itself would confirm itself. */
inline void
dropRepeatedScans(std::vector<std::string>& scans)
{
  namespace fs = boost::filesystem;
  std::set<fs::path> known;
  const auto is_repeated = [&known](const std::string& scan) {
    return fs::exists(scan) && !known.insert(fs::canonical(scan)).second;
  };
  scans.erase(std::remove_if(scans.begin(), scans.end(), is_repeated), scans.end());
}

} // namespace bundle_icp

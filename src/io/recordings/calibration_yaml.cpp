// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/recordings/calibration_json.h"

#include "io/text_file.h"

#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <pcl/exceptions.h>

namespace bundle_icp {

namespace {

using Json = nlohmann::json;

Json
toJson(const cv::FileNode& node)
{
  if (node.isMap()) {
    Json json = Json::object();
    for (const cv::FileNode& child : node)
      json[child.name()] = toJson(child);
    return json;
  }
  if (node.isSeq()) {
    Json json = Json::array();
    for (const cv::FileNode& child : node)
      json.push_back(toJson(child));
    return json;
  }
  if (node.isReal() || node.isInt())
    return node.real();
  return node.isString() ? Json(node.string()) : Json();
}

/** ROS leaves out the line by which OpenCV knows YAML, and ends each of its messages with "---". */
std::string
asOpencvYaml(const std::string& text)
{
  const std::string mark = "---\n";
  const std::size_t start = text.compare(0, mark.size(), mark) == 0 ? mark.size() : 0;
  const std::size_t end = text.find("\n---", start);
  return "%YAML:1.0\n---\n" + text.substr(start, end - start) + "\n";
}

} // namespace

void
readYamlCalibration(const std::string& path, Recording& recording)
{
  std::string text = toUtf8(readBytes(path));
  if (text.find('<') != 0 && text.compare(0, 5, "%YAML") != 0)
    text = asOpencvYaml(text);
  Json json;
  try {
    const cv::FileStorage storage(text, cv::FileStorage::READ | cv::FileStorage::MEMORY);
    if (storage.isOpened())
      json = toJson(storage.root());
  }
  catch (const cv::Exception&) {
    // The value stays null: OpenCV's text names its own source lines, not the fault.
  }
  if (!json.is_object())
    throw pcl::IOException(path + ": is neither YAML nor XML of a known form");
  takeCalibration(json, path, recording);
}

} // namespace bundle_icp

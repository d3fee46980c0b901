// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "io/text_file.h"

#include <bundle_icp/common/exceptions.h>

#include <nlohmann/json.hpp>

#include <string>

namespace bundle_icp {

using Json = nlohmann::json;

/** Calls `use` with the content of a JSON file.
 *  \throws pcl::IOException naming the file when it is no JSON, or lacks what `use` asks for. */
template <class Use>
void
withJson(const std::string& path, const Use& use)
{
  try {
    use(Json::parse(readBytes(path)));
  }
  catch (const Json::exception& error) {
    throw IOException(path + ": is not of the form that was expected: " + error.what());
  }
}

/** A size of an image [px]; 0 where there is none.
 *  \throws pcl::IOException naming the path when it is no size. */
inline int
sizeIn(const Json& json, const char* name, const std::string& path)
{
  const double size = json.value(name, 0.0);
  if (!(size >= 0 && size <= 1e5))
    throw IOException(path + ": " + name + " is no size of an image");
  return int(size);
}

} // namespace bundle_icp

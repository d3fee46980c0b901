// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
//
// OpenCV's own reader crashes on damaged files, so that these are read here.
#include "io/recordings/calibration_json.h"

#include "io/text_file.h"

#include <bundle_icp/common/exceptions.h>

#include <boost/algorithm/string.hpp>
#include <boost/property_tree/xml_parser.hpp>
#include <nlohmann/json.hpp>

#include <charconv>
#include <sstream>

namespace bundle_icp {

namespace {

using Json = nlohmann::json;

/** A number where the text is one, else a string. */
Json
scalarOf(std::string text)
{
  boost::trim(text);
  if (const std::size_t comment = text.find(" #"); comment != std::string::npos && text[0] != '"')
    text = boost::trim_copy(text.substr(0, comment));
  if (text.size() > 1 && (text[0] == '"' || text[0] == '\'') && text.back() == text[0])
    return text.substr(1, text.size() - 2);
  const char* const end = text.data() + text.size();
  double value = 0;
  const auto [rest, code] = std::from_chars(text.data() + (text[0] == '+' ? 1 : 0), end, value);
  return code == std::errc() && rest == end ? Json(value) : Json(text);
}

Json
listOf(const std::vector<std::string>& words)
{
  Json list = Json::array();
  for (const std::string& word : words)
    list.push_back(scalarOf(word));
  return list;
}

/** A line of YAML without comment; a list in brackets that goes on is joined to it. */
std::vector<std::string>
yamlLines(const std::string& text)
{
  std::vector<std::string> lines;
  std::istringstream stream(text);
  bool is_open = false; // within brackets
  for (std::string line; std::getline(stream, line);) {
    boost::trim_right(line);
    if (boost::starts_with(line, "---") && !lines.empty())
      break; // ROS ends each of its messages so
    if (line.empty() || boost::starts_with(line, "---") || line[0] == '%' ||
        boost::trim_left_copy(line)[0] == '#')
      continue;
    if (is_open)
      lines.back() += line;
    else
      lines.push_back(line);
    is_open =
        lines.back().find('[') != std::string::npos && lines.back().find(']') == std::string::npos;
  }
  return lines;
}

/** The value of a key; null where it follows in the next lines. */
Json
valueOf(std::string text)
{
  boost::trim(text);
  if (text[0] == '!') // a tag, such as !!opencv-matrix
    text.erase(0, std::min(text.find(' '), text.size()));
  boost::trim(text);
  if (text.empty())
    return {};
  if (text[0] != '[')
    return scalarOf(text);
  if (text.back() == ']')
    text.pop_back();
  return listOf(splitWords(text.substr(1)));
}

/** The part of YAML that calibrations use: maps by indentation, numbers and words, lists in
 *  brackets or with a dash in each line. Null for anything else. */
Json
parseYaml(const std::string& text)
{
  struct Map {
    std::ptrdiff_t indentation; ///< of its key
    Json* value;
  };
  Json root = Json::object();
  std::vector<Map> maps{{-1, &root}};
  for (const std::string& line : yamlLines(text)) {
    const std::size_t start = line.find_first_not_of(' ');
    Json* value = maps.back().value;
    if (line[start] == '-' && maps.size() > 1 && (value->is_null() || value->is_array())) {
      value->push_back(scalarOf(line.substr(start + 1)));
      continue;
    }
    while (std::ptrdiff_t(start) <= maps.back().indentation)
      maps.pop_back();
    value = maps.back().value;
    const std::size_t colon = line.find(':', start);
    if (colon == std::string::npos || !(value->is_null() || value->is_object()))
      return {};
    Json& member = (*value)[boost::trim_copy(line.substr(start, colon - start))];
    member = valueOf(line.substr(colon + 1));
    if (member.is_null())
      maps.push_back({std::ptrdiff_t(start), &member});
  }
  return root;
}

Json
toJson(const boost::property_tree::ptree& tree)
{
  if (tree.empty()) {
    const std::vector<std::string> words = splitWords(tree.data());
    return words.size() == 1 ? scalarOf(words[0]) : listOf(words);
  }
  Json json = Json::object();
  for (const auto& [name, child] : tree)
    json[name] = toJson(child);
  return json;
}

/** The content of the outermost element; null when the text is not XML. */
Json
parseXml(const std::string& text)
{
  boost::property_tree::ptree tree;
  std::istringstream stream(text);
  try {
    boost::property_tree::read_xml(stream, tree);
  }
  catch (const boost::property_tree::xml_parser_error&) {
    return {};
  }
  return tree.empty() ? Json() : toJson(tree.front().second);
}

} // namespace

void
readYamlCalibration(const std::string& path, Recording& recording)
{
  const std::string text = toUtf8(readBytes(path));
  const Json json = text[0] == '<' ? parseXml(text) : parseYaml(text);
  if (!json.is_object() || json.empty())
    throw IOException(path + ": is neither YAML nor XML of a known form");
  takeCalibration(json, path, recording);
}

} // namespace bundle_icp

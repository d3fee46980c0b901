// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/recordings/pcd_file.h"

#include "io/text_file.h"

#include <bundle_icp/common/exceptions.h>

#include <charconv>
#include <cstring>
#include <fstream>
#include <map>
#include <sstream>

namespace bundle_icp {
namespace {

/** A header has few lines; anything longer is no PCD file. */
constexpr std::size_t MAX_HEADER = 1 << 16;

/** Compression by LZF reaches at most 264 bytes of 3. */
constexpr std::size_t MAX_COMPRESSION = 90;

/** Largest width, height [px] and size of a point [bytes]. */
constexpr std::size_t MAX_SIZE = 1 << 16;

struct Field {
  std::string name;
  char type = 'F';          ///< F, U or I
  std::size_t size = 4;     ///< bytes of one number
  std::size_t count = 1;    ///< numbers a point
  std::size_t position = 0; ///< of its first byte in a point
};

struct Header {
  std::vector<Field> fields;
  std::size_t width = 0, height = 0;
  std::size_t point_size = 0, words = 0; ///< of a point, in bytes and in numbers
  std::string encoding;
  Pose viewpoint = Pose::Identity();
  std::size_t size = 0; ///< of the header [bytes]
};

[[noreturn]] void
refuse(const std::string& path, const std::string& reason)
{
  throw IOException(path + ": " + reason);
}

std::size_t
toSize(const std::string& word, const std::string& path)
{
  std::size_t value = 0;
  const auto [rest, code] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (code != std::errc() || rest != word.data() + word.size() || value > 1000000)
    refuse(path, "'" + word + "' in the header is no size");
  return value;
}

/** The words after each key of the header, such as WIDTH. */
std::map<std::string, TextLine>
readKeys(const std::string& bytes, const std::string& path, std::size_t& size)
{
  std::map<std::string, TextLine> keys;
  std::size_t begin = 0;
  for (std::size_t number = 1; !keys.count("DATA"); ++number) {
    const std::size_t end = bytes.find('\n', begin);
    if (end == std::string::npos || end > MAX_HEADER)
      refuse(path, "is no PCD file: its header has no line DATA");
    std::istringstream words(bytes.substr(begin, end - begin));
    std::string key;
    TextLine line{number, {}};
    if (words >> key)
      for (std::string word; words >> word;)
        line.words.push_back(word);
    if (!key.empty() && key[0] != '#')
      keys[key] = line;
    begin = end + 1;
  }
  size = begin;
  return keys;
}

void
placeFields(std::map<std::string, TextLine>& keys, const std::string& path, Header& header)
{
  const std::vector<std::string>&names = keys["FIELDS"].words, &sizes = keys["SIZE"].words,
        &types = keys["TYPE"].words, &counts = keys["COUNT"].words;
  if (names.empty() || sizes.size() != names.size() || types.size() != names.size() ||
      (!counts.empty() && counts.size() != names.size()))
    refuse(path, "FIELDS, SIZE, TYPE and COUNT of the header do not belong together");
  for (std::size_t i = 0; i < names.size(); ++i) {
    Field field{names[i], types[i][0], toSize(sizes[i], path),
                counts.empty() ? 1 : toSize(counts[i], path), header.point_size};
    if (field.size < 1 || field.size > 8 || field.count > 1000)
      refuse(path, "the field " + field.name + " has an impossible size");
    header.point_size += field.size * field.count;
    header.words += field.count;
    header.fields.push_back(field);
  }
}

Header
parseHeader(const std::string& bytes, const std::string& path)
{
  Header header;
  auto keys = readKeys(bytes, path, header.size);
  for (const char* const key : {"WIDTH", "HEIGHT", "DATA"})
    if (keys[key].words.size() != 1)
      refuse(path, std::string("is no PCD file: its header has no ") + key);
  placeFields(keys, path, header);
  header.width = toSize(keys["WIDTH"].words[0], path);
  header.height = toSize(keys["HEIGHT"].words[0], path);
  if (std::max({header.width, header.height, header.point_size}) > MAX_SIZE)
    refuse(path, "a cloud of impossible size");
  header.encoding = keys["DATA"].words[0];
  if (keys["VIEWPOINT"].words.size() == 7) {
    const std::vector<double> v = parseNumbers(keys["VIEWPOINT"], path);
    const Eigen::Quaterniond rotation(v[3], v[4], v[5], v[6]);
    if (std::abs(rotation.norm() - 1) > 1e-2)
      refuse(path, "the quaternion of VIEWPOINT is not of unit length");
    header.viewpoint = Eigen::Translation3d(v[0], v[1], v[2]) * rotation.normalized();
  }
  return header;
}

const Field&
findField(const Header& header, std::initializer_list<const char*> names, const std::string& path)
{
  for (const char* const name : names)
    for (const Field& field : header.fields)
      if (field.name == name && field.count == 1)
        return field;
  refuse(path, std::string("has no field ") + *names.begin());
}

/** The points as `DATA binary` has them, from lines of numbers. */
std::string
fromText(const std::string& bytes, const Header& header, const std::string& path)
{
  const std::size_t num_points = header.width * header.height;
  if (num_points * header.words > bytes.size() - header.size)
    refuse(path, "the file is cut off");
  std::string points(num_points * header.point_size, '\0');
  const char* at = bytes.data() + header.size;
  const char* const end = bytes.data() + bytes.size();
  const auto next_word = [&at, end] {
    while (at != end && std::isspace(static_cast<unsigned char>(*at)))
      ++at;
    const char* const begin = at;
    while (at != end && !std::isspace(static_cast<unsigned char>(*at)))
      ++at;
    return std::string_view(begin, std::size_t(at - begin));
  };
  for (std::size_t i = 0; i < num_points; ++i)
    for (const Field& field : header.fields)
      for (std::size_t k = 0; k < field.count; ++k) {
        const std::string_view word = next_word();
        char* const out = &points[i * header.point_size + field.position + k * field.size];
        const auto take = [&](auto value) {
          const auto result = std::from_chars(word.data(), word.data() + word.size(), value);
          if (word.empty() || result.ptr != word.data() + word.size())
            refuse(path, word.empty() ? "the file is cut off"
                                      : "'" + std::string(word) + "' is not a number");
          std::memcpy(out, &value, sizeof(value));
        };
        if (field.type == 'F' && field.size == 4)
          take(float());
        else if (field.type == 'F' && field.size == 8)
          take(double());
        else if (field.type == 'U' && field.size == 4)
          take(std::uint32_t());
        else if (field.type == 'I' && field.size == 4)
          take(std::int32_t());
      }
  return points;
}

/** Undoes the compression of Marc Lehmann's LibLZF: runs of bytes, and copies of earlier ones. */
std::string
decompressLzf(std::string_view in, std::size_t size, const std::string& path)
{
  std::string out;
  out.reserve(size);
  std::size_t at = 0;
  const auto next = [&]() -> std::size_t {
    if (at == in.size())
      refuse(path, "the compressed points are damaged");
    return static_cast<unsigned char>(in[at++]);
  };
  while (at < in.size() && out.size() < size) {
    const std::size_t control = next();
    if (control < 32) {
      if (in.size() - at < control + 1)
        refuse(path, "the compressed points are damaged");
      out.append(in.substr(at, control + 1));
      at += control + 1;
      continue;
    }
    std::size_t length = control >> 5;
    if (length == 7)
      length += next();
    const std::size_t back = ((control & 31) << 8) + next() + 1;
    if (back > out.size())
      refuse(path, "the compressed points are damaged");
    for (std::size_t k = 0; k < length + 2; ++k)
      out.push_back(out[out.size() - back]);
  }
  if (out.size() != size)
    refuse(path, "the compressed points are damaged");
  return out;
}

/** The same from compressed points, which are ordered by field. */
std::string
fromCompressed(const std::string& bytes, const Header& header, const std::string& path)
{
  const std::size_t num_points = header.width * header.height;
  std::uint32_t sizes[2] = {}; // compressed and not
  if (bytes.size() - header.size < sizeof(sizes))
    refuse(path, "the file is cut off");
  std::memcpy(sizes, bytes.data() + header.size, sizeof(sizes));
  const std::size_t begin = header.size + sizeof(sizes);
  if (sizes[0] > bytes.size() - begin)
    refuse(path, "the file is cut off");
  if (sizes[1] != num_points * header.point_size || sizes[1] / MAX_COMPRESSION > sizes[0])
    refuse(path, "the size of the compressed points is not that of the header");
  const std::string by_field =
      decompressLzf(std::string_view(bytes).substr(begin, sizes[0]), sizes[1], path);
  std::string points(by_field.size(), '\0');
  for (const Field& field : header.fields) {
    const std::size_t size = field.size * field.count;
    const char* in = by_field.data() + field.position * num_points;
    for (std::size_t i = 0; i < num_points; ++i, in += size)
      std::memcpy(&points[i * header.point_size + field.position], in, size);
  }
  return points;
}

std::string
readPoints(const std::string& bytes, const Header& header, const std::string& path)
{
  if (header.encoding == "ascii")
    return fromText(bytes, header, path);
  if (header.encoding == "binary_compressed")
    return fromCompressed(bytes, header, path);
  if (header.encoding != "binary")
    refuse(path, "the encoding '" + header.encoding + "' is unknown");
  const std::size_t size = header.width * header.height * header.point_size;
  if (size > bytes.size() - header.size)
    refuse(path, "the file is cut off");
  // Bytes that were put in between would move every point behind them to another pixel.
  const std::size_t rest = bytes.find_first_not_of(std::string("\0\n\r ", 4), header.size + size);
  if (rest != std::string::npos)
    refuse(path, "the file holds more data than its header says");
  return bytes.substr(header.size, size);
}

float
numberAt(const char* point, const Field& field)
{
  if (field.size == 8) {
    double value = 0;
    std::memcpy(&value, point + field.position, sizeof(value));
    return float(value);
  }
  float value = 0;
  std::memcpy(&value, point + field.position, sizeof(value));
  return value;
}

} // namespace

pcl::PointCloud<pcl::PointXYZRGBA>
readOrganizedPcd(const std::string& path)
{
  const std::string bytes = readBytes(path);
  const Header header = parseHeader(bytes, path);
  if (header.height < 2 || header.width < 2)
    refuse(path, "the cloud is not organized: its height is " + std::to_string(header.height) +
                     ", so that no point has a pixel");
  const Field* fields[4] = {&findField(header, {"x"}, path), &findField(header, {"y"}, path),
                            &findField(header, {"z"}, path),
                            &findField(header, {"rgb", "rgba"}, path)};
  for (int k = 0; k < 4; ++k)
    if ((k < 3 && (fields[k]->type != 'F' || fields[k]->size < 4)) ||
        (k == 3 && fields[k]->size != 4))
      refuse(path, "the field " + fields[k]->name + " has an unknown type");
  const std::string points = readPoints(bytes, header, path);
  pcl::PointCloud<pcl::PointXYZRGBA> cloud(std::uint32_t(header.width),
                                           std::uint32_t(header.height));
  const char* from = points.data();
  for (pcl::PointXYZRGBA& point : cloud) {
    for (int k = 0; k < 3; ++k)
      point.data[k] = numberAt(from, *fields[k]);
    std::memcpy(&point.rgba, from + fields[3]->position, sizeof(point.rgba));
    from += header.point_size;
  }
  return cloud;
}

Pose
readPcdViewpoint(const std::string& path)
{
  return parseHeader(readFirstBytes(path, MAX_HEADER), path).viewpoint;
}

} // namespace bundle_icp

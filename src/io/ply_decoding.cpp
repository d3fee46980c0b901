// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/mesh_layout.h"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <map>
#include <sstream>
#include <stdexcept>

// Not by pcl::PLYReader: pcl_io brings VTK.
namespace bundle_icp {
namespace {

class PlyReader {
public:
  explicit PlyReader(const std::string& bytes)
  : next_(bytes.data()), end_(bytes.data() + bytes.size())
  {
  }

  pcl::PolygonMesh
  read()
  {
    pcl::PolygonMesh mesh;
    for (const Element& element : readHeader()) {
      if (element.name == "vertex")
        has_color_ = declareFields(element, mesh.cloud);
      for (std::size_t i = 0; i < element.count; ++i)
        readItem(element, mesh);
    }
    mesh.cloud.width = std::uint32_t(mesh.cloud.data.size() / std::max(mesh.cloud.point_step, 1u));
    mesh.cloud.height = 1;
    mesh.cloud.row_step = std::uint32_t(mesh.cloud.data.size());
    for (const pcl::Vertices& polygon : mesh.polygons)
      for (const auto vertex : polygon.vertices)
        if (std::size_t(vertex) >= mesh.cloud.width)
          throw std::runtime_error("a face names vertex " + std::to_string(vertex) + " of " +
                                   std::to_string(mesh.cloud.width));
    return mesh;
  }

private:
  /** Reads the next number, of some type. */
  using Read = double (PlyReader::*)();

  struct Property {
    std::string name;
    Read read = nullptr, read_count = nullptr; ///< null but for lists
    int color_shift = -1;                      ///< in a packed colour; -1 = a field of its own
    bool is_packed_color = false;              ///< an integer that is a colour by itself
  };

  struct Element {
    std::string name;
    std::size_t count = 0;
    std::vector<Property> properties;
  };

  std::vector<Element>
  readHeader()
  {
    std::vector<Element> elements;
    if (readLine().str() != "ply")
      throw std::runtime_error("it does not begin with 'ply'");
    for (std::string word; word != "end_header";) {
      std::istringstream words = readLine();
      words >> word;
      if (word == "format")
        format_ = readFormat(words);
      else if (word == "element" && format_.empty())
        throw std::runtime_error("its header names no format");
      else if (word == "element") {
        elements.emplace_back();
        words >> elements.back().name >> elements.back().count;
      }
      else if (word == "property" && !elements.empty())
        elements.back().properties.push_back(readProperty(words));
      if (!words)
        throw std::runtime_error("its header is damaged");
    }
    for (const Element& element : elements)
      if (element.properties.empty() && element.count > 0)
        throw std::runtime_error("its header is damaged");
    return elements;
  }

  static std::string
  readFormat(std::istringstream& words)
  {
    std::string format;
    words >> format;
    if (format != "ascii" && format != "binary_little_endian" && format != "binary_big_endian")
      throw std::runtime_error("unknown format '" + format + "'");
    return format;
  }

  Property
  readProperty(std::istringstream& words) const
  {
    std::string type;
    Property property;
    words >> type;
    if (type == "list") {
      words >> type;
      property.read_count = readerOf(type);
      words >> type;
    }
    property.read = readerOf(type);
    words >> property.name;
    static const std::map<std::string, int> shifts{{"red", 16}, {"green", 8}, {"blue", 0}};
    if (const auto found = shifts.find(property.name); found != shifts.end())
      property.color_shift = found->second;
    const bool is_float = type.compare(0, 5, "float") == 0 || type.compare(0, 6, "double") == 0;
    property.is_packed_color = !is_float && (property.name == "rgb" || property.name == "rgba");
    return property;
  }

  Read
  readerOf(const std::string& type) const
  {
    static const std::map<std::string, Read> readers{{"char", &PlyReader::number<std::int8_t>},
                                                     {"int8", &PlyReader::number<std::int8_t>},
                                                     {"uchar", &PlyReader::number<std::uint8_t>},
                                                     {"uint8", &PlyReader::number<std::uint8_t>},
                                                     {"short", &PlyReader::number<std::int16_t>},
                                                     {"int16", &PlyReader::number<std::int16_t>},
                                                     {"ushort", &PlyReader::number<std::uint16_t>},
                                                     {"uint16", &PlyReader::number<std::uint16_t>},
                                                     {"int", &PlyReader::number<std::int32_t>},
                                                     {"int32", &PlyReader::number<std::int32_t>},
                                                     {"uint", &PlyReader::number<std::uint32_t>},
                                                     {"uint32", &PlyReader::number<std::uint32_t>},
                                                     {"float", &PlyReader::number<float>},
                                                     {"float32", &PlyReader::number<float>},
                                                     {"double", &PlyReader::number<double>},
                                                     {"float64", &PlyReader::number<double>}};
    const auto found = readers.find(type);
    if (found == readers.end())
      throw std::runtime_error("unknown type '" + type + "'");
    return format_ == "ascii" ? &PlyReader::text : found->second;
  }

  /** A field of 32 bits for each number, one for the colour.
   *  \return whether there is a colour of red, green and blue. */
  static bool
  declareFields(const Element& vertex, pcl::PCLPointCloud2& cloud)
  {
    const auto add = [&cloud](const std::string& name) {
      pcl::PCLPointField field;
      field.name = name;
      field.offset = cloud.point_step;
      field.datatype = pcl::PCLPointField::FLOAT32;
      field.count = 1;
      cloud.fields.push_back(field);
      cloud.point_step += 4;
    };
    bool has_color = false;
    for (const Property& property : vertex.properties) {
      const std::string& name = property.name;
      const bool is_normal = name == "nx" || name == "ny" || name == "nz";
      if (property.color_shift >= 0)
        has_color = true;
      else if (!property.read_count)
        add(is_normal ? std::string("normal_") + name[1] : name);
    }
    if (has_color)
      add("rgb");
    return has_color;
  }

  void
  readItem(const Element& element, pcl::PolygonMesh& mesh)
  {
    const bool is_vertex = element.name == "vertex";
    std::uint32_t color = 0xff000000;
    const auto append = [&mesh](const auto& value) {
      const auto* const bytes = reinterpret_cast<const std::uint8_t*>(&value);
      mesh.cloud.data.insert(mesh.cloud.data.end(), bytes, bytes + sizeof(value));
    };
    for (const Property& property : element.properties) {
      if (property.read_count)
        readList(element, property, mesh.polygons);
      else if (const double value = (this->*property.read)(); is_vertex) {
        if (property.color_shift >= 0)
          color |= std::uint32_t(value > 0 ? std::min(value, 255.0) : 0.0) << property.color_shift;
        else if (property.is_packed_color)
          append(value >= -2147483648.0 && value < 4294967296.0 ? std::uint32_t(std::int64_t(value))
                                                                : std::uint32_t(0));
        else
          append(float(value));
      }
    }
    if (is_vertex && has_color_)
      append(color);
  }

  void
  readList(const Element& element, const Property& property, std::vector<pcl::Vertices>& polygons)
  {
    pcl::Vertices polygon;
    for (double left = (this->*property.read_count)(); left >= 1; --left) {
      const double item = (this->*property.read)();
      polygon.vertices.push_back(item >= 0 && item < 2147483647 ? pcl::index_t(item) : 2147483647);
    }
    if (element.name == "face" && property.name.compare(0, 6, "vertex") == 0)
      polygons.push_back(polygon);
  }

  std::istringstream
  readLine()
  {
    const char* const end = std::find(next_, end_, '\n');
    if (end == end_)
      throw std::runtime_error("it ends within its header");
    std::string line(next_, end);
    line.erase(line.find_last_not_of('\r') + 1);
    next_ = end + 1;
    std::istringstream words(line);
    words.imbue(std::locale::classic());
    return words;
  }

  double
  text()
  {
    const auto isBlank = [](char c) { return c == ' ' || (c >= '\t' && c <= '\r'); };
    next_ = std::find_if_not(next_, end_, isBlank);
    double value = 0;
    const auto [rest, code] = std::from_chars(next_, end_, value);
    if (code != std::errc())
      throw std::runtime_error(next_ == end_ ? "it is truncated" : "a number is missing");
    next_ = rest;
    return value;
  }

  template <typename T>
  double
  number()
  {
    if (end_ - next_ < std::ptrdiff_t(sizeof(T)))
      throw std::runtime_error("it is truncated");
    char raw[sizeof(T)];
    std::copy_n(next_, sizeof(T), raw);
    next_ += sizeof(T);
    if (isLittleEndian() != (format_ == "binary_little_endian"))
      std::reverse(raw, raw + sizeof(T));
    T value;
    std::memcpy(&value, raw, sizeof(T));
    return double(value);
  }

  const char *next_, *const end_;
  std::string format_;
  bool has_color_ = false; ///< the vertices' cloud ends with a packed colour
};

} // namespace

pcl::PolygonMesh
decodePLY(const std::string& bytes)
{
  return PlyReader(bytes).read();
}

} // namespace bundle_icp

// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/text_file.h"

#include <bundle_icp/common/exceptions.h>
#include <bundle_icp/common/printable_text.h>

#include <boost/filesystem.hpp>

#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iomanip>
#include <locale>
#include <sstream>

namespace bundle_icp {

namespace {

double
parseNumber(const std::string& word, const std::string& where)
{
  // from_chars rather than streams: those refuse "nan", and follow the user's locale.
  const char* const begin = word.data() + (word[0] == '+' ? 1 : 0);
  const char* const end = word.data() + word.size();
  double value = 0;
  const auto [rest, code] = std::from_chars(begin, end, value);
  if (code != std::errc() || rest != end)
    throw IOException(where + quoted(word) + " is not a number");
  if (!std::isfinite(value))
    throw IOException(where + quoted(word) + " is not a finite number");
  return value;
}

} // namespace

std::ifstream
openRegularFile(const std::string& path)
{
  namespace fs = boost::filesystem;
  boost::system::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (fs::is_directory(status))
    throw IOException(path + ": is a folder, not a file");
  // A pipe without a writer would be waited for forever.
  if (fs::exists(status) && !fs::is_regular_file(status))
    throw IOException(path + ": is not a regular file");
  std::ifstream file(path, std::ios::binary);
  if (!file)
    throw IOException(path + ": cannot be opened: " + std::strerror(errno));
  return file;
}

std::string
readBytes(const std::string& path, std::uint64_t largest)
{
  std::ifstream file = openRegularFile(path);
  file.seekg(0, std::ios::end);
  const auto size = std::uint64_t(std::max<std::streamoff>(0, file.tellg()));
  if (size > largest)
    throw IOException(path + ": is too large: " + std::to_string(size) + " bytes");
  std::string bytes(std::size_t(size), '\0');
  file.seekg(0);
  file.read(bytes.data(), std::streamsize(bytes.size()));
  if (!file)
    throw IOException(path + ": cannot be read: " + std::strerror(errno));
  return bytes;
}

std::string
readFirstBytes(const std::string& path, std::size_t count)
{
  std::ifstream file = openRegularFile(path);
  std::string bytes(count, '\0');
  file.read(bytes.data(), std::streamsize(count));
  if (file.bad())
    throw IOException(path + ": cannot be read: " + std::strerror(errno));
  bytes.resize(std::size_t(file.gcount()));
  return bytes;
}

std::vector<std::string>
splitWords(std::string text)
{
  std::replace(text.begin(), text.end(), ',', ' ');
  std::istringstream blanks(text);
  std::vector<std::string> words;
  for (std::string word; blanks >> word;)
    words.push_back(word);
  return words;
}

std::string
toUtf8(const std::string& bytes)
{
  if (bytes.compare(0, 3, "\xef\xbb\xbf") == 0)
    return bytes.substr(3);
  const bool is_little = bytes.compare(0, 2, "\xff\xfe") == 0;
  if (!is_little && bytes.compare(0, 2, "\xfe\xff") != 0)
    return bytes;
  std::string text;
  for (std::size_t i = 2; i + 1 < bytes.size(); i += 2) {
    const char low = bytes[i + std::size_t(!is_little)], high = bytes[i + std::size_t(is_little)];
    text += high == 0 && (low & 0x80) == 0 ? low : '?';
  }
  return text;
}

std::vector<TextLine>
readTextLines(const std::string& path)
{
  std::istringstream stream(toUtf8(readBytes(path)));
  std::vector<TextLine> lines;
  std::string text;
  for (std::size_t number = 1; std::getline(stream, text); ++number) {
    TextLine line{number, splitWords(text.substr(0, text.find('#')))};
    if (!line.words.empty())
      lines.push_back(std::move(line));
  }
  return lines;
}

std::vector<double>
parseNumbers(const TextLine& line, const std::string& path)
{
  const std::string where = path + ":" + std::to_string(line.number) + ": ";
  std::vector<double> values;
  values.reserve(line.words.size());
  for (const std::string& word : line.words)
    values.push_back(parseNumber(word, where));
  return values;
}

std::string
shortText(double value, int digits)
{
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text << std::setprecision(digits) << value;
  return text.str();
}

std::string
quoted(const std::string& word)
{
  const std::size_t longest = 60;
  return "'" + printable(word.substr(0, longest)) + (word.size() > longest ? "...'" : "'");
}

std::string
messageOf(const std::exception& error)
{
  const std::string message = error.what();
  return message.compare(0, 2, ": ") == 0 ? message.substr(2) : message;
}

} // namespace bundle_icp

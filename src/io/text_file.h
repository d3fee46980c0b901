// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <cstdint>
#include <exception>
#include <fstream>
#include <string>
#include <vector>

namespace bundle_icp {

/** One line of a text file that is not empty, cut at blanks and commas. */
struct TextLine {
  std::size_t number = 0; ///< in the file, from 1
  std::vector<std::string> words;
};

/** The lines of a text file without comments ('#' to the end of the line) and empty
 * lines. \throws pcl::IOException naming file and reason when it cannot be read. */
std::vector<TextLine>
readTextLines(const std::string& path);

/** The words of a text, cut at blanks and commas. */
std::vector<std::string>
splitWords(std::string text);

/** Text in UTF-8, without a byte order mark, of bytes in UTF-8 or in UTF-16 with such a mark, as
 *  some recorders write. What is not ASCII becomes '?' from UTF-16. */
std::string
toUtf8(const std::string& bytes);

/** The words of a line as numbers, independent of the locale.
 *  \throws pcl::IOException naming `path`, the line and the word that is not a finite
 * number. */
std::vector<double>
parseNumbers(const TextLine& line, const std::string& path);

/** Opens a regular file.
 *  \throws pcl::IOException naming file and reason when it is none, or cannot be opened. */
std::ifstream
openRegularFile(const std::string& path);

/** All bytes of a regular file.
 *  \param largest size that is read [bytes]: a hole in a file takes no disk, but memory
 *  \throws pcl::IOException naming file and reason when it cannot be read. */
std::string
readBytes(const std::string& path, std::uint64_t largest = std::uint64_t(1) << 30);

/** The first bytes of a regular file, all of a shorter one.
 *  \throws pcl::IOException as readBytes() */
std::string
readFirstBytes(const std::string& path, std::size_t count);

/** A number with so many digits that count, independent of the locale. */
std::string
shortText(double value, int digits);

/** A word of a file in quotes, printable and cut to what a message can hold. */
std::string
quoted(const std::string& word);

/** Text of an exception, without the mark that PCL's exceptions put before it. */
std::string
messageOf(const std::exception& error);

} // namespace bundle_icp

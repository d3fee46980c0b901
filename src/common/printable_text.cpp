// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/common/printable_text.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace bundle_icp {
namespace {

/** Number of bytes of the character of UTF-8 (RFC 3629) that begins there; 0 = none does. */
std::size_t
characterLength(const unsigned char* bytes, std::size_t available)
{
  const unsigned char first = bytes[0];
  const std::size_t length = first < 0x80   ? 1
                             : first < 0xc2 ? 0
                             : first < 0xe0 ? 2
                             : first < 0xf0 ? 3
                             : first < 0xf5 ? 4
                                            : 0;
  if (length == 0 || length > available ||
      !std::all_of(bytes + 1, bytes + length, [](unsigned char c) { return (c & 0xc0) == 0x80; }))
    return 0;
  // Longer forms than needed, halves of UTF-16 pairs, and what lies beyond Unicode.
  const bool is_wrong = (first == 0xe0 && bytes[1] < 0xa0) || (first == 0xed && bytes[1] > 0x9f) ||
                        (first == 0xf0 && bytes[1] < 0x90) || (first == 0xf4 && bytes[1] > 0x8f);
  return is_wrong ? 0 : length;
}

bool
isControl(const unsigned char* character, std::size_t length)
{
  return length == 1 ? (character[0] < 0x20 && character[0] != '\n') || character[0] == 0x7f
                     : character[0] == 0xc2 && character[1] < 0xa0;
}

} // namespace

std::string
printable(const std::string& text)
{
  static const char digits[] = "0123456789abcdef";
  const auto* const bytes = reinterpret_cast<const unsigned char*>(text.data());
  std::string result;
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = characterLength(bytes + i, text.size() - i);
    if (length > 0 && !isControl(bytes + i, length)) {
      result.append(text, i, length);
      i += length;
      continue;
    }
    for (const std::size_t end = i + std::max<std::size_t>(1, length); i < end; ++i)
      result += std::string("\\x") + digits[bytes[i] >> 4] + digits[bytes[i] & 15];
  }
  return result;
}

} // namespace bundle_icp

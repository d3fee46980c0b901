// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "mutation.h"

#include <iterator>
#include <regex>
#include <utility>
#include <vector>

namespace adversity {
namespace {

using Random = std::mt19937;

/** Below `bound`, which is not 0. std::uniform_int_distribution differs between libraries. */
std::size_t
below(std::size_t bound, Random& random)
{
  return random() % bound;
}

Mutant
flipBits(std::string bytes, Random& random)
{
  const std::size_t count = 1 + below(4, random);
  for (std::size_t k = 0; k < count; ++k)
    bytes[below(bytes.size(), random)] ^= char(1 << below(8, random));
  return {bytes, std::to_string(count) + " bits flipped"};
}

Mutant
cutOff(const std::string& bytes, Random& random)
{
  const std::size_t size = below(bytes.size(), random);
  return {bytes.substr(0, size), "cut off after " + std::to_string(size) + " bytes"};
}

Mutant
insertBytes(std::string bytes, Random& random)
{
  std::string inserted;
  for (std::size_t k = 1 + below(16, random); k > 0; --k)
    inserted += char(below(256, random));
  const std::size_t place = below(bytes.size() + 1, random);
  return {bytes.insert(place, inserted),
          std::to_string(inserted.size()) + " bytes inserted at " + std::to_string(place)};
}

/** Place and length of each number of a text. */
std::vector<std::pair<std::size_t, std::size_t>>
numbersOf(const std::string& text)
{
  static const std::regex number(R"([-+]?\d+(\.\d+)?([eE][-+]?\d+)?)");
  std::vector<std::pair<std::size_t, std::size_t>> places;
  for (std::sregex_iterator match(text.begin(), text.end(), number), end; match != end; ++match)
    places.emplace_back(match->position(), match->length());
  return places;
}

Mutant
swapNumbers(const std::string& text, Random& random)
{
  const auto numbers = numbersOf(text);
  if (numbers.size() < 2)
    return flipBits(text, random);
  const std::size_t k = below(numbers.size() - 1, random);
  const auto [a, a_size] = numbers[k];
  const auto [b, b_size] = numbers[k + 1];
  const std::string first = text.substr(a, a_size), second = text.substr(b, b_size);
  return {text.substr(0, a) + second + text.substr(a + a_size, b - a - a_size) + first +
              text.substr(b + b_size),
          first + " and " + second + " swapped"};
}

Mutant
replaceNumber(std::string text, Random& random)
{
  static const char* const others[] = {"1e300", "-1",  "0",      "99999999999999999999",
                                       "nan",   "inf", "1e-300", "2147483648",
                                       "-0.5",  "1,5"};
  const auto numbers = numbersOf(text);
  if (numbers.empty())
    return flipBits(text, random);
  const auto [place, size] = numbers[below(numbers.size(), random)];
  const std::string other = others[below(std::size(others), random)];
  const std::string change = text.substr(place, size) + " replaced by " + other;
  return {text.replace(place, size, other), change};
}

Mutant
deleteLine(const std::string& text, Random& random)
{
  std::vector<std::size_t> starts{0};
  for (std::size_t i = 0; i + 1 < text.size(); ++i)
    if (text[i] == '\n')
      starts.push_back(i + 1);
  const std::size_t k = below(starts.size(), random);
  const std::size_t end = k + 1 < starts.size() ? starts[k + 1] : text.size();
  return {text.substr(0, starts[k]) + text.substr(end),
          "line " + std::to_string(k + 1) + " deleted"};
}

} // namespace

Mutant
mutate(const std::string& bytes, bool is_text, std::mt19937& random)
{
  switch (below(is_text ? 6 : 3, random)) {
  case 0:
    return flipBits(bytes, random);
  case 1:
    return cutOff(bytes, random);
  case 2:
    return insertBytes(bytes, random);
  case 3:
    return swapNumbers(bytes, random);
  case 4:
    return replaceNumber(bytes, random);
  default:
    return deleteLine(bytes, random);
  }
}

} // namespace adversity

// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/recordings/name_numbers.h"

#include <algorithm>
#include <charconv>

namespace bundle_icp {
namespace {

bool
isDigit(char letter)
{
  return letter >= '0' && letter <= '9';
}

std::string
withoutLeadingZeros(const std::string& digits)
{
  const std::size_t begin = std::min(digits.find_first_not_of('0'), digits.size());
  const bool keeps_one = begin == digits.size() || digits[begin] == '.';
  return digits.substr(keeps_one ? begin - 1 : begin);
}

/** All numbers in a name, with their fractions. */
std::vector<std::string>
numbersIn(const std::string& stem)
{
  std::vector<std::string> numbers;
  for (std::size_t i = 0; i < stem.size();) {
    if (!isDigit(stem[i])) {
      ++i;
      continue;
    }
    const std::size_t begin = i;
    const auto skip_digits = [&] {
      while (i < stem.size() && isDigit(stem[i]))
        ++i;
    };
    skip_digits();
    if (i + 1 < stem.size() && stem[i] == '.' && isDigit(stem[i + 1])) {
      ++i;
      skip_digits();
    }
    numbers.push_back(withoutLeadingZeros(stem.substr(begin, i - begin)));
  }
  return numbers;
}

/** The numbers that differ; empty when the names do not hold equally many numbers. */
std::vector<std::vector<std::string>>
differingNumbers(const std::vector<std::string>& stems)
{
  std::vector<std::vector<std::string>> all, differing(stems.size());
  for (const std::string& stem : stems)
    all.push_back(numbersIn(stem));
  for (const auto& numbers : all)
    if (numbers.size() != all[0].size() || numbers.empty())
      return {};
  for (std::size_t column = 0; column < all[0].size(); ++column) {
    const bool differs = std::any_of(
        all.begin(), all.end(), [&](const auto& row) { return row[column] != all[0][column]; });
    // One name alone: its last number counts.
    if (differs || (all.size() == 1 && column + 1 == all[0].size()))
      for (std::size_t i = 0; i < all.size(); ++i)
        differing[i].push_back(all[i][column]);
  }
  return differing;
}

std::size_t
commonBeginning(const std::vector<std::string>& texts)
{
  std::size_t length = texts[0].size();
  for (const std::string& text : texts) {
    const std::size_t end = std::min(length, text.size());
    length = std::size_t(
        std::mismatch(text.begin(), text.begin() + std::ptrdiff_t(end), texts[0].begin()).first -
        text.begin());
  }
  return length;
}

std::vector<std::vector<std::string>>
differingText(std::vector<std::string> stems)
{
  for (int side = 0; side < 2; ++side) {
    const std::size_t length = stems.size() > 1 ? commonBeginning(stems) : 0;
    for (std::string& stem : stems) {
      stem.erase(0, length);
      std::reverse(stem.begin(), stem.end());
    }
  }
  std::vector<std::vector<std::string>> parts;
  for (const std::string& stem : stems)
    parts.push_back({stem});
  return parts;
}

} // namespace

std::vector<std::vector<std::string>>
distinguishingParts(const std::vector<std::string>& stems)
{
  if (stems.empty())
    return {};
  auto parts = differingNumbers(stems);
  auto sorted = parts;
  std::sort(sorted.begin(), sorted.end());
  const bool tell_apart = !parts.empty() && !parts[0].empty() &&
                          std::adjacent_find(sorted.begin(), sorted.end()) == sorted.end();
  return tell_apart ? parts : differingText(stems);
}

bool
isNumber(const std::string& part)
{
  return !part.empty() && isDigit(part[0]) &&
         part.find_first_not_of("0123456789.") == std::string::npos;
}

double
numberOf(const std::string& part)
{
  double value = 0;
  std::from_chars(part.data(), part.data() + part.size(), value);
  return value;
}

bool
comesBefore(const std::vector<std::string>& a, const std::vector<std::string>& b)
{
  const auto less = [](const std::string& x, const std::string& y) {
    if (isNumber(x) && isNumber(y) && numberOf(x) != numberOf(y))
      return numberOf(x) < numberOf(y);
    return x < y;
  };
  return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end(), less);
}

} // namespace bundle_icp

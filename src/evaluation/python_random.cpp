// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "evaluation/python_random.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <unordered_set>

namespace bundle_icp {

namespace {

// The state that CPython's random_seed(0) makes: init_by_array of the key {0}. A
// standard engine takes what a seed sequence generates as its state, word by word.
struct PythonSeed {
  using result_type = std::uint32_t;

  template <typename Iterator>
  void
  generate(Iterator begin, Iterator end) const
  {
    constexpr std::uint32_t n = 624;
    std::array<std::uint32_t, n> state;
    const auto mix = [&](std::uint32_t i) { return state[i - 1] ^ (state[i - 1] >> 30); };
    state[0] = 19650218;
    for (std::uint32_t i = 1; i < n; ++i)
      state[i] = 1812433253u * mix(i) + i;
    std::uint32_t i = 1;
    const auto next = [&] {
      if (++i == n) {
        state[0] = state[n - 1];
        i = 1;
      }
    };
    for (std::uint32_t k = 0; k < n; ++k, next())
      state[i] = state[i] ^ (mix(i) * 1664525u);
    for (std::uint32_t k = 1; k < n; ++k, next())
      state[i] = (state[i] ^ (mix(i) * 1566083941u)) - i;
    state[0] = 0x80000000u;
    std::copy_n(state.begin(), std::min<std::size_t>(n, end - begin), begin);
  }
};

std::mt19937
seededEngine()
{
  PythonSeed seed;
  return std::mt19937(seed);
}

} // namespace

PythonRandom::PythonRandom() : engine_(seededEngine())
{
}

std::size_t
PythonRandom::below(std::size_t n)
{
  unsigned bits = 0;
  while (n >> bits)
    ++bits;
  std::size_t value = engine_() >> (32 - bits);
  while (value >= n)
    value = engine_() >> (32 - bits);
  return value;
}

std::vector<std::size_t>
PythonRandom::sample(std::size_t n, std::size_t k)
{
  std::vector<std::size_t> chosen(k);
  // Python takes from a pool unless a set of the chosen ones is smaller than that pool.
  const double set_size = 21 + std::pow(4, std::ceil(std::log(3.0 * k) / std::log(4.0)));
  if (n <= set_size) {
    std::vector<std::size_t> pool(n);
    std::iota(pool.begin(), pool.end(), std::size_t(0));
    for (std::size_t i = 0; i < k; ++i) {
      const std::size_t j = below(n - i);
      chosen[i] = pool[j];
      pool[j] = pool[n - i - 1];
    }
    return chosen;
  }
  std::unordered_set<std::size_t> used;
  for (std::size_t& j : chosen)
    do
      j = below(n);
    while (!used.insert(j).second);
  return chosen;
}

} // namespace bundle_icp

// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "graph/descriptor_products.h"

#include "common/simd.h"

#include <algorithm>
#include <cstring>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace bundle_icp {
namespace {

constexpr int LENGTH = PackedDescriptors::LENGTH;
constexpr int GROUP = PackedDescriptors::GROUP;
constexpr int CHUNKS = LENGTH / 4;
/** Rows that are multiplied together, so that each load of a column serves all of them. */
constexpr int ROWS = 4;

using RowPointers = const std::uint8_t* [ROWS];

/** out[r][16 g + lane] = product of row r with descriptor `lane` of group g. */
void
productsPortable(const RowPointers& rows, const PackedDescriptors& second, std::int32_t* const* out)
{
  for (int g = 0; g < second.groups(); ++g)
    for (int r = 0; r < ROWS; ++r) {
      std::int32_t sum[GROUP] = {};
      const std::uint8_t* column = second.group(g);
      for (int c = 0; c < CHUNKS; ++c, column += 4 * GROUP)
        for (int lane = 0; lane < GROUP; ++lane)
          for (int k = 0; k < 4; ++k)
            sum[lane] += std::int32_t(rows[r][4 * c + k]) * column[4 * lane + k];
      std::copy(sum, sum + GROUP, out[r] + g * GROUP);
    }
}

#if defined(__x86_64__)
std::int32_t
loadChunk(const std::uint8_t* row, int chunk)
{
  std::int32_t value;
  std::memcpy(&value, row + 4 * chunk, 4);
  return value;
}

BUNDLE_ICP_AVX2 void
productsAvx2(const RowPointers& rows, const PackedDescriptors& second, std::int32_t* const* out)
{
  const __m256i ones = _mm256_set1_epi16(1);
  for (int g = 0; g < second.groups(); ++g) {
    __m256i sum[ROWS][2];
    for (auto& s : sum)
      s[0] = s[1] = _mm256_setzero_si256();
    const auto* column = reinterpret_cast<const __m256i*>(second.group(g));
    for (int c = 0; c < CHUNKS; ++c) {
      const __m256i low = _mm256_loadu_si256(column + 2 * c);
      const __m256i high = _mm256_loadu_si256(column + 2 * c + 1);
      for (int r = 0; r < ROWS; ++r) {
        // Values of at most 127: the 16-bit sums of two products cannot saturate.
        const __m256i a = _mm256_set1_epi32(loadChunk(rows[r], c));
        sum[r][0] =
            _mm256_add_epi32(sum[r][0], _mm256_madd_epi16(_mm256_maddubs_epi16(a, low), ones));
        sum[r][1] =
            _mm256_add_epi32(sum[r][1], _mm256_madd_epi16(_mm256_maddubs_epi16(a, high), ones));
      }
    }
    for (int r = 0; r < ROWS; ++r)
      for (int half = 0; half < 2; ++half)
        _mm256_storeu_si256(reinterpret_cast<__m256i*>(out[r] + g * GROUP + 8 * half),
                            sum[r][half]);
  }
}

BUNDLE_ICP_AVX512 void
productsAvx512(const RowPointers& rows, const PackedDescriptors& second, std::int32_t* const* out)
{
  for (int g = 0; g < second.groups(); g += 2) {
    const bool pair = g + 1 < second.groups();
    const std::uint8_t* column[2] = {second.group(g), second.group(pair ? g + 1 : g)};
    __m512i sum[ROWS][2];
    for (auto& s : sum)
      s[0] = s[1] = _mm512_setzero_si512();
    for (int c = 0; c < CHUNKS; ++c) {
      const __m512i b0 = _mm512_loadu_si512(column[0] + 64 * c);
      const __m512i b1 = _mm512_loadu_si512(column[1] + 64 * c);
      for (int r = 0; r < ROWS; ++r) {
        const __m512i a = _mm512_set1_epi32(loadChunk(rows[r], c));
        sum[r][0] = _mm512_dpbusd_epi32(sum[r][0], a, b0);
        sum[r][1] = _mm512_dpbusd_epi32(sum[r][1], a, b1);
      }
    }
    for (int r = 0; r < ROWS; ++r) {
      _mm512_storeu_si512(out[r] + g * GROUP, sum[r][0]);
      if (pair)
        _mm512_storeu_si512(out[r] + (g + 1) * GROUP, sum[r][1]);
    }
  }
}
#else
constexpr auto productsAvx2 = productsPortable, productsAvx512 = productsPortable;
#endif

BUNDLE_ICP_INLINE std::int32_t
largest(const std::int32_t* values, int n)
{
  std::int32_t result = -1;
  for (int j = 0; j < n; ++j)
    result = std::max(result, values[j]);
  return result;
}

BUNDLE_ICP_INLINE void
updateColumns(const std::int32_t* values, int row, int n, std::int32_t* best, int* index)
{
  for (int j = 0; j < n; ++j) {
    const bool better = values[j] > best[j];
    index[j] = better ? row : index[j];
    best[j] = better ? values[j] : best[j];
  }
}

} // namespace

PackedDescriptors::PackedDescriptors(const cv::Mat& descriptors)
: size_(descriptors.rows), data_(std::size_t(groups()) * GROUP * LENGTH, 0)
{
  for (int i = 0; i < size_; ++i) {
    std::uint8_t* target = data_.data() + std::size_t(i / GROUP) * GROUP * LENGTH;
    const std::uint8_t* row = descriptors.ptr<std::uint8_t>(i);
    for (int c = 0; c < CHUNKS; ++c)
      std::memcpy(target + (c * GROUP + i % GROUP) * 4, row + 4 * c, 4);
  }
}

void
bestProducts(const cv::Mat& first, const PackedDescriptors& second, std::vector<BestProducts>& rows,
             std::vector<int>& columns)
{
  const int n = second.size(), padded = second.groups() * GROUP;
  rows.assign(first.rows, {});
  columns.assign(n, -1);
  std::vector<std::int32_t> column_best(n, -1), buffer(std::size_t(ROWS) * padded);
  std::int32_t* out[ROWS];
  for (int r = 0; r < ROWS; ++r)
    out[r] = buffer.data() + std::size_t(r) * padded;

  const auto products = simd::choose(productsPortable, productsAvx2, productsAvx512);
  for (int i = 0; i < first.rows; i += ROWS) {
    RowPointers pointers;
    for (int r = 0; r < ROWS; ++r)
      pointers[r] = first.ptr<std::uint8_t>(std::min(i + r, first.rows - 1));
    products(pointers, second, out);
    for (int r = 0; r < ROWS && i + r < first.rows; ++r) {
      simd::call<updateColumns>(out[r], i + r, n, column_best.data(), columns.data());
      BestProducts& row = rows[i + r];
      row.best = simd::call<largest>(out[r], n);
      if (row.best < 0)
        continue; // there are no columns
      row.index = int(std::find(out[r], out[r] + n, row.best) - out[r]);
      out[r][row.index] = -1;
      row.second = simd::call<largest>(out[r], n);
    }
  }
}

} // namespace bundle_icp

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

/** Half of a descriptor. Its even and its odd pairs of values are summed in 16 bits each. */
constexpr int HALF = LENGTH / 2;

/** Whether no sum over the even or odd pairs of half a descriptor can exceed 16 bits in the product
 *  with another one of which the same is true (Cauchy and Schwarz). So it is for all of norm 256 but
 *  those with nearly all they have in a quarter of their values. */
BUNDLE_ICP_SIMD bool
fitsWords(const std::uint8_t* row)
{
  bool fits = true;
  for (const std::uint8_t* half = row; half < row + LENGTH; half += HALF) {
    std::uint32_t squares[GROUP] = {};
    for (int k = 0; k < HALF; k += GROUP)
      for (int i = 0; i < GROUP; ++i)
        squares[i] += std::uint32_t(half[k + i]) * half[k + i];
    std::uint32_t even = 0, odd = 0;
    for (int i = 0; i < GROUP; i += 4) {
      even += squares[i] + squares[i + 1];
      odd += squares[i + 2] + squares[i + 3];
    }
    fits = fits && even <= 65535 && odd <= 65535;
  }
  return fits;
}

/** out[r][16 g + lane] = product of row r with descriptor `lane` of group g. */
using Kernel = void (*)(const RowPointers&, const PackedDescriptors&, std::int32_t* const*);

void
productsPortable(const RowPointers& rows,
                 const PackedDescriptors& second,
                 std::int32_t* const* out)
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

__attribute__((target("avx2"))) void
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
        sum[r][0] = _mm256_add_epi32(
            sum[r][0], _mm256_madd_epi16(_mm256_maddubs_epi16(a, low), ones));
        sum[r][1] = _mm256_add_epi32(
            sum[r][1], _mm256_madd_epi16(_mm256_maddubs_epi16(a, high), ones));
      }
    }
    for (int r = 0; r < ROWS; ++r)
      for (int half = 0; half < 2; ++half)
        _mm256_storeu_si256(reinterpret_cast<__m256i*>(out[r] + g * GROUP + 8 * half),
                            sum[r][half]);
  }
}

/** The same where all descriptors passed fitsWords(): half as many multiplications. */
__attribute__((target("avx2"))) void
wordProductsAvx2(const RowPointers& rows, const PackedDescriptors& second, std::int32_t* const* out)
{
  constexpr int HALF_CHUNKS = CHUNKS / 2;
  const __m256i low_word = _mm256_set1_epi32(0xffff);
  for (int g = 0; g < second.groups(); ++g) {
    const auto* column = reinterpret_cast<const __m256i*>(second.group(g));
    for (int first = 0; first < CHUNKS; first += HALF_CHUNKS) {
      __m256i sum[ROWS][2];
      for (auto& s : sum)
        s[0] = s[1] = _mm256_setzero_si256();
#pragma GCC unroll 4
      for (int c = first; c < first + HALF_CHUNKS; ++c) {
        const __m256i low = _mm256_loadu_si256(column + 2 * c);
        const __m256i high = _mm256_loadu_si256(column + 2 * c + 1);
        for (int r = 0; r < ROWS; ++r) {
          const __m256i a = _mm256_set1_epi32(loadChunk(rows[r], c));
          sum[r][0] = _mm256_add_epi16(sum[r][0], _mm256_maddubs_epi16(a, low));
          sum[r][1] = _mm256_add_epi16(sum[r][1], _mm256_maddubs_epi16(a, high));
        }
      }
      for (int r = 0; r < ROWS; ++r)
        for (int part = 0; part < 2; ++part) {
          auto* target = reinterpret_cast<__m256i*>(out[r] + g * GROUP + 8 * part);
          const __m256i both = _mm256_add_epi32(_mm256_and_si256(sum[r][part], low_word),
                                                _mm256_srli_epi32(sum[r][part], 16));
          _mm256_storeu_si256(
              target, first == 0 ? both : _mm256_add_epi32(_mm256_loadu_si256(target), both));
        }
    }
  }
}

__attribute__((target("avx512f,avx512vnni"))) void
productsVnni(const RowPointers& rows, const PackedDescriptors& second, std::int32_t* const* out)
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
#endif

/** What this processor is fastest with. */
struct Kernels {
  Kernel any = productsPortable;
  Kernel words = productsPortable; ///< for those that pass fitsWords()

  Kernels()
  {
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vnni"))
      any = words = productsVnni;
    else if (__builtin_cpu_supports("avx2")) {
      any = productsAvx2;
      words = wordProductsAvx2;
    }
#endif
  }
};

BUNDLE_ICP_SIMD std::int32_t
largest(const std::int32_t* values, int n)
{
  std::int32_t result = -1;
  for (int j = 0; j < n; ++j)
    result = std::max(result, values[j]);
  return result;
}

BUNDLE_ICP_SIMD void
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
    fit_words_ = fit_words_ && fitsWords(row);
  }
}

void
bestProducts(const cv::Mat& first,
             const PackedDescriptors& second,
             std::vector<BestProducts>& rows,
             std::vector<int>& columns)
{
  static const Kernels kernels;
  const int n = second.size(), padded = second.groups() * GROUP;
  rows.assign(first.rows, {});
  columns.assign(n, -1);
  std::vector<std::int32_t> column_best(n, -1), buffer(std::size_t(ROWS) * padded);
  std::int32_t* out[ROWS];
  for (int r = 0; r < ROWS; ++r)
    out[r] = buffer.data() + std::size_t(r) * padded;

  for (int i = 0; i < first.rows; i += ROWS) {
    RowPointers pointers;
    for (int r = 0; r < ROWS; ++r)
      pointers[r] = first.ptr<std::uint8_t>(std::min(i + r, first.rows - 1));
    const bool fit_words =
        second.fitWords() && std::all_of(pointers, pointers + ROWS, fitsWords);
    (fit_words ? kernels.words : kernels.any)(pointers, second, out);
    for (int r = 0; r < ROWS && i + r < first.rows; ++r) {
      updateColumns(out[r], i + r, n, column_best.data(), columns.data());
      BestProducts& row = rows[i + r];
      row.best = largest(out[r], n);
      if (row.best < 0)
        continue; // there are no columns
      row.index = int(std::find(out[r], out[r] + n, row.best) - out[r]);
      out[r][row.index] = -1;
      row.second = largest(out[r], n);
    }
  }
}

} // namespace bundle_icp

// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/export.h>

#include <cstdint>
#include <cstring>
#ifdef __SSE__
#include <xmmintrin.h>
#endif

/** Marks a kernel, a function with hot loops that simd::call() runs, and all that it calls with
 *  vectors: compiled as part of each variant. */
#define BUNDLE_ICP_INLINE inline __attribute__((always_inline))
#ifdef __x86_64__
#define BUNDLE_ICP_AVX2 __attribute__((target("avx2,bmi,bmi2")))
#define BUNDLE_ICP_AVX512                                                                          \
  __attribute__((target("avx512f,avx512bw,avx512dq,avx512vl,avx512vnni,bmi,bmi2")))
#else
#define BUNDLE_ICP_AVX2
#define BUNDLE_ICP_AVX512
#endif

/** Kernels for several instruction sets from one source. All variants of a kernel give the same
 *  bits: the library is compiled without contraction to fused multiply-add. Vectors are those of
 *  the compiler; comparisons give masks of -1 and 0. Only for source files. */
namespace bundle_icp::simd {

/** Variants: every processor, AVX2, and AVX-512 as of Ice Lake and Zen 4. */
enum class Variant { BASELINE, AVX2, AVX512 };

/** The best variant that the processor runs. */
BUNDLE_ICP_EXPORT Variant
bestVariant();

/** The variant in use: the best one, or the choice of a test. */
BUNDLE_ICP_EXPORT Variant
variant();

/** For tests: at most bestVariant(). */
BUNDLE_ICP_EXPORT void
setVariant(Variant variant);

/** Selects the variant in use from functions that are each written for one instruction set. */
template <typename Function>
Function
choose(Function baseline, Function avx2, Function avx512)
{
  const Function functions[] = {baseline, avx2, avx512};
  return functions[int(variant())];
}

template <auto kernel>
struct Call;

template <typename Result, typename... Arguments, Result (*kernel)(Arguments...)>
struct Call<kernel> {
  Result
  operator()(Arguments... arguments) const
  {
    return choose(baseline, avx2, avx512)(arguments...);
  }

private:
  static Result
  baseline(Arguments... arguments)
  {
    return kernel(arguments...);
  }

  BUNDLE_ICP_AVX2 static Result
  avx2(Arguments... arguments)
  {
    return kernel(arguments...);
  }

  BUNDLE_ICP_AVX512 static Result
  avx512(Arguments... arguments)
  {
    return kernel(arguments...);
  }
};

/** Runs a kernel, compiled for the variant in use: call<kernel>(arguments...). */
template <auto kernel>
constexpr Call<kernel> call{};

constexpr int LANES = 8;
using Floats = float __attribute__((vector_size(4 * LANES)));
using Ints = std::int32_t __attribute__((vector_size(4 * LANES)));
using Words = std::uint32_t __attribute__((vector_size(4 * LANES)));
using Shorts = std::int16_t __attribute__((vector_size(2 * LANES)));
using HalfWords = std::uint16_t __attribute__((vector_size(2 * LANES)));
using Doubles = double __attribute__((vector_size(32)));

constexpr Floats LANE_NUMBER = {0, 1, 2, 3, 4, 5, 6, 7};

template <typename To, typename From>
BUNDLE_ICP_INLINE To
bitCast(From from)
{
  To to;
  static_assert(sizeof(to) == sizeof(from), "a cast of bits keeps the size");
  std::memcpy(&to, &from, sizeof(to));
  return to;
}

template <typename Vector, typename Scalar>
BUNDLE_ICP_INLINE Vector
load(const Scalar* from)
{
  Vector vector;
  std::memcpy(&vector, from, sizeof(vector));
  return vector;
}

template <typename Vector>
BUNDLE_ICP_INLINE Vector
smaller(Vector a, Vector b)
{
  return a < b ? a : b;
}

template <typename Vector>
BUNDLE_ICP_INLINE Vector
larger(Vector a, Vector b)
{
  return a > b ? a : b;
}

BUNDLE_ICP_INLINE Floats
magnitude(Floats values)
{
  return larger(values, -values);
}

/** first = from[index], second = from[index + 1]: half the loads of two gathers. */
template <typename Vector, typename Scalar>
BUNDLE_ICP_INLINE void
gatherPairs(const Scalar* from, Ints index, Vector& first, Vector& second)
{
  static_assert(sizeof(Scalar) == 4);
  using Pairs = std::int64_t __attribute__((vector_size(4 * LANES)));
  const auto pair = [from](std::int32_t i) {
    std::int64_t both;
    std::memcpy(&both, from + i, sizeof(both));
    return both;
  };
  const Pairs low = {pair(index[0]), pair(index[1]), pair(index[2]), pair(index[3])};
  const Pairs high = {pair(index[4]), pair(index[5]), pair(index[6]), pair(index[7])};
  const Vector a = bitCast<Vector>(low), b = bitCast<Vector>(high);
  first = __builtin_shufflevector(a, b, 0, 2, 4, 6, 8, 10, 12, 14);
  second = __builtin_shufflevector(a, b, 1, 3, 5, 7, 9, 11, 13, 15);
}

template <typename Vector, typename Scalar>
BUNDLE_ICP_INLINE Vector
gather(const Scalar* from, Ints index)
{
  return Vector{from[index[0]], from[index[1]], from[index[2]], from[index[3]],
                from[index[4]], from[index[5]], from[index[6]], from[index[7]]};
}

BUNDLE_ICP_INLINE Floats
toFloats(Words words)
{
  // Through signed numbers, for which every instruction set has a conversion.
  return __builtin_convertvector(bitCast<Ints>(words), Floats);
}

BUNDLE_ICP_INLINE bool
any(Ints mask)
{
#ifdef __SSE__
  // The compiler has no short form of its own for this.
  __m128 halves[2];
  std::memcpy(halves, &mask, sizeof(mask));
  return _mm_movemask_ps(_mm_or_ps(halves[0], halves[1])) != 0;
#else
  const auto parts = bitCast<std::int64_t __attribute__((vector_size(4 * LANES)))>(mask);
  return (parts[0] | parts[1] | parts[2] | parts[3]) != 0;
#endif
}

/** 1 / sqrt(values) for positive values, to 5e-6. */
BUNDLE_ICP_INLINE Floats
inverseSquareRoot(Floats values)
{
  // Two steps of Newton's method from the well-known first guess on the bits of a
  // float.
  Floats root = bitCast<Floats>(0x5f3759df - (bitCast<Ints>(values) >> 1));
  root *= 1.5f - 0.5f * values * root * root;
  return root * (1.5f - 0.5f * values * root * root);
}

} // namespace bundle_icp::simd

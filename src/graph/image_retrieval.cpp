// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/graph/image_retrieval.h>

#include "common/array_store.h"
#include "common/parallel.h"

#include <bundle_icp/common/exceptions.h>

#include <algorithm>
#include <limits>
#include <random>

namespace bundle_icp {
namespace {

constexpr int LENGTH = 128;
constexpr int LLOYD_ITERATIONS = 10;

Eigen::Map<const Eigen::Matrix<std::uint8_t, LENGTH, 1>>
row(const cv::Mat& descriptors, int i)
{
  return Eigen::Map<const Eigen::Matrix<std::uint8_t, LENGTH, 1>>(descriptors.ptr<std::uint8_t>(i));
}

Eigen::MatrixXf
toMatrix(const cv::Mat& descriptors)
{
  Eigen::MatrixXf matrix(LENGTH, descriptors.rows);
  for (int i = 0; i < descriptors.rows; ++i)
    matrix.col(i) = row(descriptors, i).cast<float>();
  return matrix;
}

/** Index of the nearest word for each column. */
std::vector<int>
assign(const Eigen::MatrixXf& samples, const Eigen::MatrixXf& words)
{
  const Eigen::VectorXf half_norms = 0.5f * words.colwise().squaredNorm().transpose();
  const Eigen::MatrixXf scores = (words.transpose() * samples).colwise() - half_norms;
  std::vector<int> nearest(samples.cols());
  for (Eigen::Index i = 0; i < samples.cols(); ++i)
    scores.col(i).maxCoeff(&nearest[i]);
  return nearest;
}

/** Lloyd's k-means from a random choice of samples; words that lose all samples stay. */
Eigen::MatrixXf
trainVocabulary(const Eigen::MatrixXf& samples, int words, std::uint64_t seed)
{
  std::mt19937_64 random(seed);
  Eigen::MatrixXf vocabulary(LENGTH, words);
  for (int w = 0; w < words; ++w)
    vocabulary.col(w) = samples.col((random() >> 32) * samples.cols() >> 32);
  for (int iteration = 0; iteration < LLOYD_ITERATIONS; ++iteration) {
    const std::vector<int> nearest = assign(samples, vocabulary);
    Eigen::MatrixXf sum = Eigen::MatrixXf::Zero(LENGTH, words);
    Eigen::VectorXf count = Eigen::VectorXf::Zero(words);
    for (Eigen::Index i = 0; i < samples.cols(); ++i) {
      sum.col(nearest[i]) += samples.col(i);
      count[nearest[i]] += 1;
    }
    for (int w = 0; w < words; ++w)
      if (count[w] > 0)
        vocabulary.col(w) = sum.col(w) / count[w];
  }
  return vocabulary;
}

} // namespace

bool
RetrievalOptions::isValid(std::string* error) const
{
  const char* reason = vocabulary_size < 1 ? "vocabulary_size must be >= 1"
                       : training_size < vocabulary_size
                           ? "training_size must be >= vocabulary_size"
                       : num_threads < 0 ? "num_threads must be >= 0"
                                         : nullptr;
  if (reason && error)
    *error = reason;
  return !reason;
}

ImageRetrieval::ImageRetrieval(const std::vector<const Features*>& frames,
                               const RetrievalOptions& options)
: options_(options)
{
  std::string error;
  if (!options.isValid(&error))
    throw BadArgumentException("ImageRetrieval: " + error);
  std::size_t total = 0;
  for (const Features* frame : frames)
    total += frame->size();
  const std::size_t step = std::max<std::size_t>(1, total / options.training_size);
  Eigen::MatrixXf samples(LENGTH, (total + step - 1) / step);
  std::size_t next = 0, seen = 0;
  for (const Features* frame : frames) {
    for (; next < seen + frame->size(); next += step)
      samples.col(Eigen::Index(next / step)) =
          row(frame->descriptors, int(next - seen)).cast<float>();
    seen += frame->size();
    releaseMemory(frame->descriptors);
  }
  vocabulary_ = total == 0 ? Eigen::MatrixXf::Zero(LENGTH, options.vocabulary_size)
                           : trainVocabulary(samples, options.vocabulary_size, options.seed);

  descriptors_.resize(frames.size());
  parallelFor(frames.size(), options.num_threads, {},
              [&](std::size_t i) { descriptors_[i] = describe(*frames[i]); });
}

void
ImageRetrieval::add(const Features& frame)
{
  descriptors_.push_back(describe(frame));
}

Eigen::VectorXf
ImageRetrieval::describe(const Features& frame) const
{
  Eigen::MatrixXf vlad = Eigen::MatrixXf::Zero(LENGTH, vocabulary_.cols());
  if (frame.size() > 0) {
    const Eigen::MatrixXf samples = toMatrix(frame.descriptors);
    const std::vector<int> nearest = assign(samples, vocabulary_);
    for (Eigen::Index i = 0; i < samples.cols(); ++i)
      vlad.col(nearest[i]) += samples.col(i) - vocabulary_.col(nearest[i]);
    releaseMemory(frame.descriptors);
  }
  for (Eigen::Index w = 0; w < vlad.cols(); ++w)
    if (const float norm = vlad.col(w).norm(); norm > 0)
      vlad.col(w) /= norm;
  Eigen::VectorXf flat = Eigen::Map<Eigen::VectorXf>(vlad.data(), vlad.size());
  if (const float norm = flat.norm(); norm > 0)
    flat /= norm;
  return flat;
}

std::vector<std::size_t>
ImageRetrieval::mostSimilar(std::size_t query, const std::vector<std::size_t>& among,
                            std::size_t count) const
{
  std::vector<std::pair<float, std::size_t>> scored;
  for (const std::size_t i : among)
    if (i != query)
      scored.emplace_back(-similarity(query, i), i);
  count = std::min(count, scored.size());
  std::partial_sort(scored.begin(), scored.begin() + count, scored.end());
  std::vector<std::size_t> result;
  for (std::size_t k = 0; k < count; ++k)
    result.push_back(scored[k].second);
  return result;
}

float
ImageRetrieval::typicalSimilarity() const
{
  constexpr std::size_t MAX_QUERIES = 100;
  if (size() < 2)
    return 0;
  std::vector<float> best(std::min(size(), MAX_QUERIES));
  parallelFor(best.size(), options_.num_threads, {}, [&](std::size_t k) {
    const std::size_t query = k * size() / best.size();
    best[k] = -std::numeric_limits<float>::infinity();
    for (std::size_t i = 0; i < size(); ++i)
      if (i != query)
        best[k] = std::max(best[k], similarity(query, i));
  });
  std::nth_element(best.begin(), best.begin() + best.size() / 2, best.end());
  return best[best.size() / 2];
}

std::vector<std::size_t>
ImageRetrieval::cover(std::size_t first, double similarity_bound) const
{
  std::vector<std::size_t> chosen;
  std::vector<float> best(size(), -std::numeric_limits<float>::infinity());
  std::size_t next = first;
  while (chosen.size() < size()) {
    chosen.push_back(next);
    parallelFor((size() + 63) / 64, options_.num_threads, {}, [&](std::size_t block) {
      for (std::size_t i = 64 * block; i < std::min(size(), 64 * block + 64); ++i)
        best[i] = std::max(best[i], similarity(next, i));
    });
    best[next] = std::numeric_limits<float>::infinity();
    next = std::min_element(best.begin(), best.end()) - best.begin();
    if (best[next] >= similarity_bound)
      break;
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

} // namespace bundle_icp

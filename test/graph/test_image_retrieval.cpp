// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/graph/image_retrieval.h>

#include "landmarks.h"
#include "messages.h"

#include <pcl/exceptions.h>

#include <algorithm>
#include <numeric>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

std::vector<const Features*>
roomFrames()
{
  std::vector<const Features*> frames;
  for (std::size_t i = 0; i < 10; ++i)
    frames.push_back(&roomFeatures(6 * i));
  return frames;
}

RetrievalOptions
fastOptions()
{
  RetrievalOptions options;
  options.training_size = 2000;
  return options;
}

} // namespace

TEST(ImageRetrieval, SimilarityIsACosine)
{
  const ImageRetrieval retrieval(roomFrames(), fastOptions());
  ASSERT_EQ(retrieval.size(), 10u);
  for (std::size_t i = 0; i < retrieval.size(); ++i) {
    EXPECT_NEAR(retrieval.similarity(i, i), 1, 1e-5);
    for (std::size_t j = 0; j < i; ++j) {
      EXPECT_EQ(retrieval.similarity(i, j), retrieval.similarity(j, i));
      EXPECT_LT(retrieval.similarity(i, j), 1);
    }
  }
  EXPECT_GT(retrieval.similarity(0, 1), retrieval.similarity(0, 9));
}

TEST(ImageRetrieval, AnImageIsMostSimilarToItselfSlightlyMoved)
{
  ImageRetrieval retrieval(roomFrames(), fastOptions());
  std::vector<std::size_t> all(retrieval.size());
  std::iota(all.begin(), all.end(), 0);
  for (const std::size_t i : {0, 4, 9}) {
    const Pose pose = room().worldFromCamera(6 * i) * randomMotion(i, 0.03, 0.02);
    retrieval.add(extractFeatures(room().render(pose), room().camera()));
    const std::vector<std::size_t> similar = retrieval.mostSimilar(retrieval.size() - 1, all, 3);
    ASSERT_EQ(similar.size(), 3u);
    EXPECT_EQ(similar[0], i);
  }
}

TEST(ImageRetrieval, MostSimilarLeavesOutTheImageItself)
{
  const ImageRetrieval retrieval(roomFrames(), fastOptions());
  const std::vector<std::size_t> similar = retrieval.mostSimilar(2, {1, 2, 3, 8}, 10);
  ASSERT_EQ(similar.size(), 3u);
  EXPECT_EQ(std::count(similar.begin(), similar.end(), 2u), 0);
  EXPECT_GE(retrieval.similarity(2, similar[0]), retrieval.similarity(2, similar[1]));
  EXPECT_GE(retrieval.similarity(2, similar[1]), retrieval.similarity(2, similar[2]));
  EXPECT_TRUE(retrieval.mostSimilar(2, {}, 5).empty());
}

TEST(ImageRetrieval, CoverHasASimilarImageForEach)
{
  const ImageRetrieval retrieval(roomFrames(), fastOptions());
  std::size_t last = 0;
  for (const double bound : {-0.5, 0.1, 0.2, 0.3, 0.6}) {
    const std::vector<std::size_t> chosen = retrieval.cover(3, bound);
    EXPECT_TRUE(std::is_sorted(chosen.begin(), chosen.end()));
    EXPECT_EQ(std::adjacent_find(chosen.begin(), chosen.end()), chosen.end());
    EXPECT_EQ(std::count(chosen.begin(), chosen.end(), 3u), 1);
    EXPECT_GE(chosen.size(), last);
    last = chosen.size();
    for (std::size_t i = 0; i < retrieval.size(); ++i) {
      float best = -1;
      for (const std::size_t key : chosen)
        best = std::max(best, i == key ? 1 : retrieval.similarity(i, key));
      EXPECT_GE(best, bound);
    }
  }
  EXPECT_EQ(retrieval.cover(3, -1).size(), 1u);
  EXPECT_EQ(retrieval.cover(3, 0.999).size(), retrieval.size());
}

TEST(ImageRetrieval, TypicalSimilarityIsTheMedianOfTheBest)
{
  const ImageRetrieval retrieval(roomFrames(), fastOptions());
  std::vector<std::size_t> all(retrieval.size());
  std::iota(all.begin(), all.end(), 0);
  std::size_t not_above = 0, not_below = 0;
  for (const std::size_t i : all) {
    const float best = retrieval.similarity(i, retrieval.mostSimilar(i, all, 1).front());
    not_above += best <= retrieval.typicalSimilarity();
    not_below += best >= retrieval.typicalSimilarity();
  }
  EXPECT_GE(not_above, retrieval.size() / 2);
  EXPECT_GE(not_below, retrieval.size() / 2);
  EXPECT_EQ(ImageRetrieval({&roomFeatures(0)}, fastOptions()).typicalSimilarity(), 0);
}

TEST(ImageRetrieval, DoesNotDependOnThreads)
{
  RetrievalOptions options = fastOptions();
  options.num_threads = 1;
  const ImageRetrieval one(roomFrames(), options);
  options.num_threads = 2;
  const ImageRetrieval two(roomFrames(), options);
  for (std::size_t i = 0; i < one.size(); ++i)
    for (std::size_t j = 0; j < one.size(); ++j)
      EXPECT_EQ(one.similarity(i, j), two.similarity(i, j));
  EXPECT_EQ(one.cover(0, 0.3), two.cover(0, 0.3));
  EXPECT_EQ(one.typicalSimilarity(), two.typicalSimilarity());
}

TEST(ImageRetrieval, AnImageWithoutFeaturesResemblesNothing)
{
  std::vector<const Features*> frames = roomFrames();
  const Features none = noFeatures();
  frames.push_back(&none);
  const ImageRetrieval retrieval(frames, fastOptions());
  EXPECT_EQ(retrieval.similarity(10, 0), 0);
  const ImageRetrieval empty({&none}, fastOptions());
  EXPECT_EQ(empty.size(), 1u);
}

TEST(ImageRetrieval, RefusesInvalidOptions)
{
  const auto message = [](const RetrievalOptions& options) {
    return messageOf<pcl::BadArgumentException>([&] { ImageRetrieval({}, options); });
  };
  RetrievalOptions options;
  options.vocabulary_size = 0;
  EXPECT_CONTAINS(message(options), "ImageRetrieval: vocabulary_size must be >= 1");
  options = {};
  options.training_size = options.vocabulary_size - 1;
  EXPECT_CONTAINS(message(options), "training_size must be >= vocabulary_size");
  options = {};
  options.num_threads = -1;
  EXPECT_CONTAINS(message(options), "num_threads must be >= 0");
}

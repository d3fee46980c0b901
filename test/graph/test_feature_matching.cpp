// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/graph/feature_matching.h>

#include "landmarks.h"
#include "messages.h"

#include <pcl/exceptions.h>

#include <set>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

void
expectOneToOne(const std::vector<FeatureMatch>& matches)
{
  std::set<int> second;
  for (std::size_t k = 0; k < matches.size(); ++k) {
    EXPECT_TRUE(second.insert(matches[k].second).second);
    if (k > 0) {
      EXPECT_LT(matches[k - 1].first, matches[k].first);
    }
  }
}

void
expectSame(const std::vector<FramePair>& a, const std::vector<FramePair>& b)
{
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t k = 0; k < a.size(); ++k) {
    EXPECT_EQ(a[k].first, b[k].first);
    EXPECT_EQ(a[k].second, b[k].second);
    EXPECT_EQ(a[k].num_putative, b[k].num_putative);
    EXPECT_EQ(a[k].first_from_second.matrix(), b[k].first_from_second.matrix());
    ASSERT_EQ(a[k].matches.size(), b[k].matches.size());
    for (std::size_t m = 0; m < a[k].matches.size(); ++m) {
      EXPECT_EQ(a[k].matches[m].first, b[k].matches[m].first);
      EXPECT_EQ(a[k].matches[m].second, b[k].matches[m].second);
    }
  }
}

} // namespace

TEST(MatchDescriptors, FindsTheSameLandmarksOneToOne)
{
  const Landmarks landmarks(300);
  const std::vector<LandmarkView> views = landmarkViews(landmarks, 2);
  for (const MatchingBackend backend : {MatchingBackend::EXACT, MatchingBackend::KDTREE}) {
    MatchingOptions options;
    options.backend = backend;
    const std::vector<FeatureMatch> matches =
        matchDescriptors(views[0].features.descriptors, views[1].features.descriptors, options);
    EXPECT_GT(matches.size(), 50u);
    expectOneToOne(matches);
    for (const FeatureMatch& match : matches)
      EXPECT_EQ(views[0].landmarks[match.first], views[1].landmarks[match.second]);
  }
}

TEST(MatchDescriptors, IsOneToOneOnARenderedPair)
{
  const cv::Mat &a = roomFeatures(0).descriptors, &b = roomFeatures(4).descriptors;
  const std::vector<FeatureMatch> matches = matchDescriptors(a, b);
  EXPECT_GT(matches.size(), 100u);
  expectOneToOne(matches);
}

TEST(MatchDescriptors, DropsAmbiguousOnes)
{
  const cv::Mat descriptors = Landmarks(40).descriptors();
  cv::Mat twice = descriptors.clone();
  twice.push_back(descriptors);
  EXPECT_EQ(matchDescriptors(descriptors, descriptors).size(), 40u);
  EXPECT_TRUE(matchDescriptors(descriptors, twice).empty());
}

TEST(MatchDescriptors, EmptyListsHaveNoMatches)
{
  const cv::Mat none(0, 128, CV_8UC1), some = Landmarks(40).descriptors();
  for (const MatchingBackend backend : {MatchingBackend::EXACT, MatchingBackend::KDTREE}) {
    MatchingOptions options;
    options.backend = backend;
    EXPECT_TRUE(matchDescriptors(none, some, options).empty());
    EXPECT_TRUE(matchDescriptors(some, none, options).empty());
    EXPECT_TRUE(matchDescriptors(some, some.row(0), options).empty());
  }
}

TEST(VerifyMatches, KeepsTrueAndDropsFalseOnes)
{
  const Landmarks landmarks(300);
  const std::vector<LandmarkView> views = landmarkViews(landmarks, 2);
  std::vector<FeatureMatch> putative =
      matchDescriptors(views[0].features.descriptors, views[1].features.descriptors);
  const std::size_t count = putative.size();
  // Half of the matches are exchanged with each other.
  for (std::size_t k = 0; k + 2 < count / 2; ++k)
    std::swap(putative[k].second, putative[k + 2].second);
  const FramePair pair =
      verifyMatches(views[0].features, views[1].features, putative, landmarks.camera());
  EXPECT_EQ(pair.num_putative, count);
  for (const FeatureMatch& match : pair.matches)
    EXPECT_LT((landmarks.point(views[0].landmarks[match.first]) -
               landmarks.point(views[1].landmarks[match.second]))
                  .norm(),
              0.1);
  EXPECT_GE(pair.matches.size(), count / 2 - 2);
  EXPECT_LE(pair.matches.size(), count / 2 + 12);
  const Pose truth = views[0].world_from_camera.inverse() * views[1].world_from_camera;
  EXPECT_LT((pair.first_from_second.matrix() - truth.matrix()).norm(), 2e-3);
}

TEST(VerifyMatches, NeedsDepthAndEnoughMatches)
{
  const Landmarks landmarks(300);
  std::vector<LandmarkView> views = landmarkViews(landmarks, 2);
  const std::vector<FeatureMatch> putative =
      matchDescriptors(views[0].features.descriptors, views[1].features.descriptors);
  MatchingOptions options;
  options.min_matches = putative.size() + 1;
  EXPECT_TRUE(
      verifyMatches(views[0].features, views[1].features, putative, landmarks.camera(), options)
          .matches.empty());
  std::fill(views[0].features.depths.begin(), views[0].features.depths.end(),
            std::numeric_limits<float>::quiet_NaN());
  EXPECT_TRUE(verifyMatches(views[0].features, views[1].features, putative, landmarks.camera())
                  .matches.empty());
}

TEST(MatchPairs, PoseOfARenderedPairIsTheTruth)
{
  const std::vector<const Features*> features{&roomFeatures(0), &roomFeatures(4)};
  const std::vector<FramePair> pairs = matchPairs(features, room().camera(), {{0, 1}});
  ASSERT_EQ(pairs.size(), 1u);
  const Pose truth = room().worldFromCamera(0).inverse() * room().worldFromCamera(4);
  const Pose error = pairs[0].first_from_second * truth.inverse();
  EXPECT_LT(error.translation().norm(), 0.01);
  EXPECT_LT(degrees(rotationAngle(error)), 0.3);
}

TEST(MatchPairs, DoesNotDependOnThreads)
{
  std::vector<const Features*> features;
  std::vector<std::pair<std::size_t, std::size_t>> candidates;
  for (std::size_t i = 0; i < 5; ++i) {
    features.push_back(&roomFeatures(4 * i));
    for (std::size_t j = 0; j < i; ++j)
      candidates.emplace_back(j, i);
  }
  for (const MatchingBackend backend : {MatchingBackend::EXACT, MatchingBackend::KDTREE}) {
    MatchingOptions options;
    options.backend = backend;
    options.num_threads = 1;
    const std::vector<FramePair> one = matchPairs(features, room().camera(), candidates, options);
    options.num_threads = 3;
    expectSame(one, matchPairs(features, room().camera(), candidates, options));
    EXPECT_GE(one.size(), 4u);
  }
}

TEST(MatchPairs, DoesNotDependOnTheMemoryThatDescriptorsMayTake)
{
  const Landmarks landmarks(200);
  const std::vector<LandmarkView> views = landmarkViews(landmarks, 9);
  std::vector<const Features*> features;
  std::vector<std::pair<std::size_t, std::size_t>> candidates;
  for (std::size_t i = 0; i < views.size(); ++i) {
    features.push_back(&views[i].features);
    for (std::size_t j = 0; j < i; ++j)
      candidates.emplace_back(i, j);
  }
  const std::vector<FramePair> expected = matchPairs(features, landmarks.camera(), candidates);
  EXPECT_EQ(expected.size(), candidates.size());
  for (const std::size_t max_memory : {std::size_t(1), 6 * features[0]->descriptors.total()}) {
    MatchingOptions options;
    options.max_memory = max_memory;
    std::size_t done = 0;
    expectSame(expected, matchPairs(features, landmarks.camera(), candidates, options,
                                    [&](const Progress& progress) {
                                      EXPECT_GT(progress.done, done);
                                      EXPECT_EQ(progress.total, candidates.size());
                                      done = progress.done;
                                      return true;
                                    }));
    EXPECT_GT(done, 0u);
  }
}

TEST(MatchPairs, ReportsProgressAndStops)
{
  const Landmarks landmarks(100);
  const std::vector<LandmarkView> views = landmarkViews(landmarks, 2);
  const std::vector<const Features*> features{&views[0].features, &views[1].features};
  const std::vector<std::pair<std::size_t, std::size_t>> candidates(10, {0, 1});
  MatchingOptions options;
  options.num_threads = 1;
  std::size_t calls = 0;
  const auto stop_at_third = [&calls](const Progress& progress) {
    EXPECT_EQ(progress.stage, "matching");
    EXPECT_EQ(progress.total, 10u);
    return ++calls < 3;
  };
  EXPECT_EQ(matchPairs(features, landmarks.camera(), candidates, options, stop_at_third).size(),
            3u);
  EXPECT_EQ(calls, 3u);
}

TEST(MatchPairs, RefusesBadIndicesAndOptions)
{
  const std::vector<const Features*> features{&roomFeatures(0), &roomFeatures(4)};
  const auto message = [&](std::size_t i, std::size_t j, MatchingOptions options = {}) {
    return messageOf<pcl::BadArgumentException>([&] {
      matchPairs(features, room().camera(), {{i, j}}, options);
    });
  };
  EXPECT_CONTAINS(message(0, 2), "candidate pair 0, 2 of 2 images");
  EXPECT_CONTAINS(message(2, 0), "candidate pair 2, 0 of 2 images");
  EXPECT_CONTAINS(message(1, 1), "candidate pair 1, 1 of 2 images");
  MatchingOptions options;
  options.ratio = 0;
  EXPECT_CONTAINS(message(0, 1, options), "ratio must lie in (0, 1]");
  options = {};
  options.min_matches = 2;
  EXPECT_CONTAINS(message(0, 1, options), "min_matches must be >= 3");
  options = {};
  options.num_threads = -1;
  EXPECT_CONTAINS(message(0, 1, options), "num_threads must be >= 0");
  options = {};
  options.verification.confidence = 0;
  EXPECT_CONTAINS(message(0, 1, options), "confidence");
}

// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "common/array_store.h"
#include "messages.h"
#include "temporary_folder.h"

#include <opencv2/core.hpp>
#include <pcl/exceptions.h>
#include <sys/resource.h>

#include <csignal>
#include <thread>
#include <vector>

using namespace bundle_icp;

namespace {

cv::Mat
numbers(int rows, int cols, unsigned seed)
{
  cv::Mat array(rows, cols, CV_8UC1);
  cv::RNG(seed).fill(array, cv::RNG::UNIFORM, 0, 256);
  return array;
}

bool
areEqual(const cv::Mat& a, const cv::Mat& b)
{
  return a.size() == b.size() && a.type() == b.type() && cv::norm(a, b, cv::NORM_INF) == 0;
}

std::size_t
bytesOf(const cv::Mat& array)
{
  return array.total() * array.elemSize();
}

} // namespace

TEST(ArrayStore, KeepsArraysInMemoryUpToItsBound)
{
  const TemporaryFolder folder;
  ArrayStore store(10000, folder.path());
  const cv::Mat first = numbers(60, 100, 1), second = numbers(60, 100, 2);
  EXPECT_EQ(store.keep(first).data, first.data);
  const cv::Mat kept = store.keep(second);
  EXPECT_NE(kept.data, second.data);
  EXPECT_TRUE(areEqual(kept, second));
  EXPECT_EQ(store.bytesInMemory(), bytesOf(first));
  EXPECT_EQ(store.bytesInFile(), bytesOf(second));
  EXPECT_EQ(store.keep(first.rowRange(0, 40)).data, first.data); // for which there is room
  EXPECT_TRUE(boost::filesystem::is_empty(folder.path()));
}

TEST(ArrayStore, HoldsArraysOfAnyFormAndSize)
{
  ArrayStore store(0);
  const cv::Mat wide = numbers(50, 300, 1);
  for (const cv::Mat& array :
       {numbers(1, 1, 2), wide.colRange(7, 99), cv::Mat(3, 5, CV_32FC3, cv::Scalar(1, 2, 3)),
        numbers(3000, 14000, 3)}) // more than is mapped at once
    EXPECT_TRUE(areEqual(store.keep(array), array)) << array.size();
  EXPECT_TRUE(store.keep(cv::Mat()).empty());
  EXPECT_EQ(store.keep(cv::Mat(0, 128, CV_8UC1)).cols, 128);
}

TEST(ArrayStore, ArraysOutliveItAndCanBeReadAfterTheirMemoryWasReleased)
{
  const cv::Mat expected = numbers(500, 128, 1);
  cv::Mat kept;
  {
    ArrayStore store(0);
    kept = store.keep(expected);
  }
  for (int i = 0; i < 2; ++i) {
    EXPECT_TRUE(areEqual(kept, expected));
    releaseMemory(kept);
  }
  const cv::Mat part = kept.rowRange(100, 200);
  kept.release();
  EXPECT_TRUE(areEqual(part, expected.rowRange(100, 200)));
  EXPECT_TRUE(areEqual(part.clone(), expected.rowRange(100, 200)));
  releaseMemory(expected);
  EXPECT_TRUE(areEqual(expected, numbers(500, 128, 1)));
}

TEST(ArrayStore, ServesThreadsAtOnce)
{
  ArrayStore store(1 << 20);
  std::vector<cv::Mat> kept(400);
  std::vector<std::thread> threads;
  for (unsigned t = 0; t < 4; ++t)
    threads.emplace_back([&kept, &store, t] {
      for (unsigned i = t; i < kept.size(); i += 4) {
        kept[i] = store.keep(numbers(int(i) + 1, 128, i));
        releaseMemory(kept[i]);
      }
    });
  for (std::thread& thread : threads)
    thread.join();
  for (unsigned i = 0; i < kept.size(); ++i)
    EXPECT_TRUE(areEqual(kept[i], numbers(int(i) + 1, 128, i))) << i;
  EXPECT_LE(store.bytesInMemory(), std::size_t(1) << 20);
  EXPECT_GT(store.bytesInFile(), std::size_t(1) << 20);
}

TEST(ArrayStore, NamesAFolderThatCannotTakeTheFile)
{
  const std::string missing = TemporaryFolder().path("missing");
  ArrayStore store(100, missing);
  store.keep(numbers(1, 100, 1)); // which needs no file
  EXPECT_CONTAINS(messageOf<pcl::IOException>([&] { store.keep(numbers(1, 1, 1)); }),
                  missing + ": what does not fit in memory cannot be kept in this folder: No such");
}

TEST(ArrayStore, SaysThatTheDiskIsFull)
{
  const TemporaryFolder folder;
  ArrayStore store(0, folder.path());
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  rlimit small = before;
  small.rlim_cur = 100000; // what a file may take, as on a disk with so much room
  setrlimit(RLIMIT_FSIZE, &small);
  const std::string message =
      messageOf<pcl::IOException>([&] { store.keep(numbers(200, 1000, 1)); });
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_CONTAINS(message, folder.path() + ": what does not fit in memory");
}

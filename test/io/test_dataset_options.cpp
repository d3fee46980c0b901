// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/io/rgbd_dataset.h>

#include "messages.h"
#include "recordings.h"

#include <gtest/gtest.h>
#include <pcl/exceptions.h>

#include <cmath>
#include <set>

using namespace bundle_icp;

namespace {

std::vector<std::size_t>
ids(const RGBDDataset& dataset)
{
  std::vector<std::size_t> result;
  for (std::size_t i = 0; i < dataset.size(); ++i)
    result.push_back(dataset.id(i));
  return result;
}

} // namespace

TEST(DatasetOptions, StrideAndMaxFramesChoose)
{
  const TemporaryFolder folder;
  recordings::writeOpen3d(folder.path(), 10);
  DatasetOptions options;
  options.stride = 3;
  EXPECT_EQ(ids(*openDataset(folder.path(), options)), (std::vector<std::size_t>{0, 3, 6, 9}));
  options.max_frames = 2;
  EXPECT_EQ(ids(*openDataset(folder.path(), options)), (std::vector<std::size_t>{0, 3}));
}

TEST(DatasetOptions, ShuffleIsAPermutationThatTheSeedFixes)
{
  const TemporaryFolder folder;
  recordings::writeOpen3d(folder.path(), 10);
  DatasetOptions options;
  options.shuffle_seed = 7;
  const auto dataset = openDataset(folder.path(), options);
  const auto order = ids(*dataset);
  EXPECT_EQ(std::set<std::size_t>(order.begin(), order.end()).size(), 10u);
  EXPECT_EQ(order, ids(*openDataset(folder.path(), options)));
  EXPECT_EQ(order,
            (std::vector<std::size_t>{0, 7, 4, 9, 3, 1, 2, 8, 6, 5})); // the same on every platform
  for (std::size_t i = 0; i < 10; ++i)
    EXPECT_FLOAT_EQ(dataset->read(i).depth.at<float>(0, 0), 1 + 0.1f * order[i]);
  options.shuffle_seed = 8;
  EXPECT_NE(order, ids(*openDataset(folder.path(), options)));
}

TEST(DatasetOptions, EachFieldIsChecked)
{
  std::string error;
  EXPECT_TRUE(DatasetOptions().isValid(&error)) << error;
  DatasetOptions options;
  options.stride = 0;
  EXPECT_FALSE(options.isValid(&error));
  EXPECT_CONTAINS(error, "stride");
  EXPECT_CONTAINS(messageOf<pcl::BadArgumentException>([&] { openDataset("x", options); }),
                  "stride");
  for (const double bad : {0.0, -1.0, double(NAN), double(INFINITY)}) {
    options = {};
    options.depth_scale = bad;
    EXPECT_FALSE(options.isValid(&error)) << bad;
    EXPECT_CONTAINS(error, "depth scale");
    options = {};
    options.max_time_difference = bad;
    EXPECT_FALSE(options.isValid(&error)) << bad;
    EXPECT_CONTAINS(error, "time difference");
  }
  options = {};
  options.intrinsics = parseIntrinsics("1,1,3,4");
  options.intrinsics->width = 640;
  options.intrinsics->height = 480;
  EXPECT_FALSE(options.isValid(&error));
}

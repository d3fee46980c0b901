// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/pose_numbers.h"

#include "io/text_file.h"

#include <bundle_icp/common/exceptions.h>
#include <bundle_icp/io/calibration_io.h>

#include <boost/filesystem.hpp>

#include <algorithm>
#include <cmath>

namespace bundle_icp {

namespace {

Eigen::Matrix4d
matrixOf(const std::vector<double>& numbers, const std::string& source)
{
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  if (numbers.size() == 12 || numbers.size() == 16) {
    for (std::size_t i = 0; i < numbers.size(); ++i)
      matrix(Eigen::Index(i / 4), Eigen::Index(i % 4)) = numbers[i];
    return matrix;
  }
  if (numbers.size() != 3 && numbers.size() != 7)
    throw IOException(source + ": " + std::to_string(numbers.size()) +
                      " numbers where the place of the depth camera is expected: tx ty tz "
                      "[qx qy qz qw] in metres, or a matrix of 4x4");
  matrix.topRightCorner<3, 1>() << numbers[0], numbers[1], numbers[2];
  if (numbers.size() == 7)
    matrix.topLeftCorner<3, 3>() =
        Eigen::Quaterniond(numbers[6], numbers[3], numbers[4], numbers[5]).toRotationMatrix();
  return matrix;
}

} // namespace

Pose
depthToColor(const std::vector<double>& numbers, const std::string& source)
{
  const Eigen::Matrix4d matrix = matrixOf(numbers, source);
  if (!isRigid(matrix) || matrix.row(3) != Eigen::RowVector4d(0, 0, 0, 1))
    throw IOException(source + ": depth to colour is no rigid motion; expected a rotation "
                               "and a translation, row by row, with 0 0 0 1 as last row");
  const Pose pose = closestPose(matrix);
  const double distance = pose.translation().norm();
  if (distance > 1)
    throw IOException(source + ": the depth camera is " + shortText(distance, 4) +
                      " m from the colour camera; lengths are in metres");
  return pose;
}

Pose
readDepthToColor(const std::string& text)
{
  std::vector<double> numbers;
  if (boost::filesystem::is_regular_file(text)) {
    for (const TextLine& line : readTextLines(text)) {
      const std::vector<double> more = parseNumbers(line, text);
      numbers.insert(numbers.end(), more.begin(), more.end());
    }
    return depthToColor(numbers, text);
  }
  if (text.find_first_not_of("0123456789+-.eE, ") != std::string::npos)
    throw IOException(text + ": no such file, and no numbers tx,ty,tz[,qx,qy,qz,qw]");
  for (const std::string& word : splitWords(text))
    numbers.push_back(parseNumbers({1, {word}}, text).front());
  return depthToColor(numbers, text);
}

} // namespace bundle_icp

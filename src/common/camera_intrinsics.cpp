// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/common/camera_intrinsics.h>

#include <bundle_icp/common/exceptions.h>

#include <algorithm>
#include <cmath>
#include <locale>
#include <sstream>
#include <vector>

namespace bundle_icp {

CameraIntrinsics
CameraIntrinsics::reduced(int factor) const
{
  CameraIntrinsics camera = *this;
  camera.width = width / factor;
  camera.height = height / factor;
  camera.fx = fx / factor;
  camera.fy = fy / factor;
  // Pixel centres are whole numbers: the edge at -0.5 is what the two grids share.
  camera.cx = (cx + 0.5) / factor - 0.5;
  camera.cy = (cy + 0.5) / factor - 0.5;
  return camera;
}

CameraIntrinsics
CameraIntrinsics::undistorted() const
{
  CameraIntrinsics camera = *this;
  camera.k1 = camera.k2 = camera.p1 = camera.p2 = camera.k3 = 0;
  return camera;
}

bool
CameraIntrinsics::isValid(std::string* error) const
{
  const auto fail = [error](const std::string& reason) {
    if (error)
      *error = "impossible camera intrinsics: " + reason;
    return false;
  };
  for (const double value : {fx, fy, cx, cy, k1, k2, p1, p2, k3})
    if (!std::isfinite(value))
      return fail("a value is not finite");
  if (width <= 0 || height <= 0)
    return fail("image size " + std::to_string(width) + "x" + std::to_string(height));
  if (fx <= 0 || fy <= 0)
    return fail("focal length " + std::to_string(fx) + ", " + std::to_string(fy) +
                " px must be positive");
  const double radians = M_PI / 180;
  for (const double view : {2 * std::atan(width / (2 * fx)), 2 * std::atan(height / (2 * fy))})
    if (view < 5 * radians || view > 160 * radians)
      return fail("focal length " + std::to_string(fx) + ", " + std::to_string(fy) +
                  " px gives a field of view of " + std::to_string(view / radians) +
                  " degrees; expected 5 to 160");
  // To the borders of the outer pixels, where reduced images have theirs as well.
  if (cx < -0.5 || cy < -0.5 || cx > width - 0.5 || cy > height - 0.5)
    return fail("principal point " + std::to_string(cx) + ", " + std::to_string(cy) +
                " px lies outside the image of " + std::to_string(width) + "x" +
                std::to_string(height));
  return depth_noise.isValid(error);
}

CameraIntrinsics
parseIntrinsics(const std::string& text)
{
  std::string blanks = text;
  std::replace(blanks.begin(), blanks.end(), ',', ' ');
  std::istringstream stream(blanks);
  stream.imbue(std::locale::classic());
  std::vector<double> values;
  for (double value; stream >> value;)
    values.push_back(value);
  if (!stream.eof() || (values.size() != 4 && values.size() != 9))
    throw BadArgumentException("intrinsics '" + text + "': expected fx,fy,cx,cy[,k1,k2,p1,p2,k3]");
  CameraIntrinsics camera;
  camera.fx = values[0];
  camera.fy = values[1];
  camera.cx = values[2];
  camera.cy = values[3];
  if (values.size() == 9) {
    camera.k1 = values[4];
    camera.k2 = values[5];
    camera.p1 = values[6];
    camera.p2 = values[7];
    camera.k3 = values[8];
  }
  return camera;
}

} // namespace bundle_icp

// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "changes.h"
#include "inputs.h"
#include "temporary_folder.h"

#include <boost/algorithm/string/replace.hpp>
#include <opencv2/imgcodecs.hpp>

namespace adversity {
namespace {

namespace fs = boost::filesystem;
using Change = std::function<void(Recording&)>;

/** Rewrites both lists of a TUM folder. */
Change
lists(const std::function<std::string(const std::string&)>& rewrite)
{
  return [=](Recording& r) {
    r.afterwards = [=](const std::string& folder) {
      for (const char* name : {"/rgb.txt", "/depth.txt"})
        writeText(folder + name, rewrite(readText(folder + name)));
    };
  };
}

/** Changes the written folder. */
Change
folder(const std::function<void(const std::string&)>& change)
{
  return [=](Recording& r) { r.afterwards = change; };
}

void
cut(const std::string& file, double share)
{
  const std::string bytes = readText(file);
  writeText(file, bytes.substr(0, std::size_t(share * double(bytes.size()))));
}

std::string
toUtf16(const std::string& text)
{
  std::string result = "\xff\xfe";
  for (const char c : text)
    result += {c, '\0'};
  return result;
}

std::string
withoutImages(const std::string& list, std::size_t first, std::size_t count)
{
  std::string result = list;
  for (std::size_t i = first; i < first + count; ++i) {
    const std::string name = (i < 10 ? "000" : "00") + std::to_string(i) + ".png";
    boost::replace_all(result, name, "absent" + name);
  }
  return result;
}

void
putBlanksIntoNames(Recording& r)
{
  for (std::vector<Image>* images : {&r.color, &r.depth})
    for (Image& image : *images)
      image.name = "frame " + image.name;
}

/** What macOS and editors leave beside images. */
void
addHiddenFiles(const std::string& folder)
{
  for (int i = 0; i < 5; ++i)
    writeText(folder + "/color/._000" + std::to_string(i) + ".png", "Mac OS X");
  writeText(folder + "/depth/Thumbs.db", "thumbs");
  writeText(folder + "/depth/0000.png.tmp", "half");
}

Change
open3d(const std::function<void(const std::string&)>& change)
{
  return [=](Recording& r) {
    toOpen3d(r);
    r.afterwards = change;
  };
}

} // namespace

std::vector<Input>
fileInputs()
{
  const std::vector<std::string> table = {"table"};
  const auto smaller = [](const std::string& folder) {
    const std::string file = folder + "/depth/0007.png";
    cv::Mat image = cv::imread(file, cv::IMREAD_UNCHANGED);
    cv::resize(image, image, {}, 0.5, 0.5, cv::INTER_NEAREST);
    cv::imwrite(file, image);
  };
  const auto pgm = [](Recording& r) {
    toOpen3d(r);
    r.depth_extension = ".pgm";
  };
  return {
      {"color_truncated", table,
       folder([](const std::string& f) { cut(f + "/rgb/0005.png", 0.5); }), ""},
      {"depth_truncated", table,
       folder([](const std::string& f) { cut(f + "/depth/0005.png", 0.5); }), "", 0.5, true},
      {"first_depth_empty", table,
       folder([](const std::string& f) { writeText(f + "/depth/0000.png", ""); }), ""},
      {"color_is_text", table,
       folder([](const std::string& f) { writeText(f + "/rgb/0005.png", "404 Not Found\n"); }), ""},
      {"one_depth_of_half_the_size", table, folder(smaller), ""},
      {"list_empty", table, folder([](const std::string& f) { writeText(f + "/rgb.txt", ""); }),
       "rgb.txt: lists no image"},
      {"list_of_comments", table,
       folder([](const std::string& f) { writeText(f + "/depth.txt", "# depth\n# none\n"); }),
       "depth.txt: lists no image"},
      {"list_absent", table, folder([](const std::string& f) { fs::remove(f + "/depth.txt"); }),
       "depth.txt"},
      {"list_names_some_absent", table,
       lists([](const std::string& list) { return withoutImages(list, 3, 5); }), ""},
      {"list_names_all_absent", table,
       lists([](const std::string& list) { return withoutImages(list, 0, 24); }),
       "none of the 24 listed images exists"},
      {"list_with_bom", table,
       lists([](const std::string& list) { return "\xef\xbb\xbf# time file\n" + list; }), ""},
      {"list_with_crlf", table,
       lists([](const std::string& list) { return boost::replace_all_copy(list, "\n", "\r\n"); }),
       "", 0.5, true},
      {"list_with_tabs_and_blanks", table, lists([](const std::string& list) {
         return boost::replace_all_copy(boost::replace_all_copy(list, " ", "\t "), "\n", "  \n\n");
       }),
       ""},
      {"list_with_commas", table,
       lists([](const std::string& list) { return boost::replace_all_copy(list, " ", ","); }),
       "rgb.txt:1"},
      {"list_with_a_heading", table,
       lists([](const std::string& list) { return "timestamp filename\n" + list; }), "rgb.txt:1"},
      {"list_of_utf16", table, lists(toUtf16), "rgb.txt"},
      {"list_rows_twice", table, lists([](const std::string& list) { return list + list; }), ""},
      {"blanks_in_names", table, putBlanksIntoNames, ""},
      {"hidden_files", table, open3d(addHiddenFiles), ""},
      {"depth_is_pgm", table, pgm, ""},
      {"intrinsics_absent", table,
       open3d([](const std::string& f) { fs::remove(f + "/intrinsic.json"); }),
       "intrinsics are unknown"},
      {"intrinsics_are_words", table,
       folder([](const std::string& f) { writeText(f + "/intrinsics.txt", "fx fy cx cy\n"); }),
       "intrinsics.txt:1"},
      {"nothing_there", table, folder([](const std::string& f) {
         for (const char* name : {"rgb", "depth", "rgb.txt", "depth.txt", "intrinsics.txt"})
           fs::remove_all(f + "/" + name);
       }),
       "the folder is empty"},
  };
}

} // namespace adversity

// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/stereo/pictures.hpp"

#include <glob.h>
#include <zlib.h>

#include <array>
#include <opencv2/imgcodecs.hpp>

#include "common/io/files/file_access.hpp"

namespace brainshift::client {
namespace {

namespace fs = std::filesystem;

// A picture of more bytes is no photograph, and a small gzip file may
// stand for any number of them.
constexpr std::size_t kMaxBytes = std::size_t{1} << 30;

bool is_gzip(const std::string& bytes) {
  return bytes.size() > 2 && bytes[0] == '\x1f' && bytes[1] == '\x8b';
}

Result<std::string> gunzip(const fs::path& path) {
  const gzFile file = gzopen(path.c_str(), "rb");
  if (file == nullptr) return io::file_error(ErrorCode::kUnreadable, path, "cannot be opened");
  std::string bytes;
  std::array<char, 1 << 16> buffer{};
  int count = 0;
  while ((count = gzread(file, buffer.data(), buffer.size())) > 0 && bytes.size() < kMaxBytes)
    bytes.append(buffer.data(), static_cast<std::size_t>(count));
  const bool whole = count == 0;
  const bool closed = gzclose(file) == Z_OK;
  if (!whole || !closed)
    return io::file_error(ErrorCode::kUnreadable, path, "is a damaged gzip file");
  return bytes;
}

}  // namespace

Result<stereo::GrayImage> read_picture(const fs::path& path) {
  auto bytes = io::read_file(path);
  if (bytes && is_gzip(*bytes)) bytes = gunzip(path);
  if (!bytes) return tl::unexpected(bytes.error());
  if (bytes->empty()) return io::file_error(ErrorCode::kUnreadable, path, "is empty");
  cv::Mat picture;
  try {
    const cv::Mat raw(1, static_cast<int>(bytes->size()), CV_8UC1, bytes->data());
    picture = cv::imdecode(raw, cv::IMREAD_GRAYSCALE);
  } catch (const cv::Exception&) {
    picture.release();
  }
  if (picture.empty() || picture.type() != CV_8UC1)
    return io::file_error(ErrorCode::kUnreadable, path, "is no picture that can be read");
  stereo::GrayImage image(picture.cols, picture.rows);
  for (int y = 0; y < picture.rows; ++y)
    for (int x = 0; x < picture.cols; ++x) image.at(x, y) = picture.at<std::uint8_t>(y, x);
  return image;
}

Result<std::vector<fs::path>> expand_patterns(const std::vector<std::string>& names) {
  std::vector<fs::path> files;
  for (const std::string& name : names) {
    glob_t found{};
    const int status = ::glob(name.c_str(), 0, nullptr, &found);
    for (std::size_t i = 0; status == 0 && i < found.gl_pathc; ++i)
      files.emplace_back(found.gl_pathv[i]);
    ::globfree(&found);
    if (status != 0) return fail(ErrorCode::kNotFound, name + ": no file of this name or pattern");
  }
  return files;
}

}  // namespace brainshift::client

// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/preview/preview.hpp"

#include <opencv2/imgcodecs.hpp>
#include <utility>

#include "client/tools/preview/case_pictures.hpp"
#include "common/io/files/file_access.hpp"

namespace brainshift::client {
namespace {

namespace fs = std::filesystem;

Status write_png(const cv::Mat& image, const fs::path& path) {
  std::vector<unsigned char> bytes;
  if (!cv::imencode(".png", image, bytes, {cv::IMWRITE_PNG_COMPRESSION, 6})) {
    return fail(ErrorCode::kInternal, path.string() + ": cannot be encoded as PNG");
  }
  return io::write_file(path, std::string(bytes.begin(), bytes.end()));
}

std::string summary_text(const PreviewSummary& summary) {
  std::string text;
  for (const std::string& line : summary.facts) text += line + "\n";
  for (const std::string& line : summary.doubts) text += "look again: " + line + "\n";
  for (const std::string& line : summary.problems) text += "cannot be prepared: " + line + "\n";
  return text;
}

}  // namespace

Result<PreviewSummary> write_preview(const fs::path& case_file, const fs::path& out,
                                     const Progress& progress) {
  const auto view = view_case(case_file, progress);
  if (!view) return tl::unexpected(view.error());
  std::error_code failed;
  fs::create_directories(out, failed);
  if (failed) return io::file_error(ErrorCode::kWriteFailed, out, failed.message());
  PreviewSummary summary{facts(*view), doubts(*view), view->problems, {}};
  std::vector<std::pair<std::string, cv::Mat>> pictures;
  if (view->tumour.num_vertices() > 0) {
    pictures.emplace_back("slices-tumour.png",
                          slices_picture(*view, centre_of(view->tumour), "tumour's centre"));
  }
  if (const auto opening = opening_of(*view)) {
    pictures.emplace_back("slices-craniotomy.png",
                          slices_picture(*view, opening->centre, "craniotomy's centre"));
  }
  if (view->brain.num_vertices() > 0) {
    pictures.emplace_back("surface.png", surface_picture(*view));
  }
  for (const auto& [name, image] : pictures) {
    if (Status ok = write_png(image, out / name); !ok) return tl::unexpected(ok.error());
    summary.files.push_back(out / name);
  }
  const fs::path text = out / "preview.txt";
  if (Status ok = io::write_file(text, summary_text(summary)); !ok)
    return tl::unexpected(ok.error());
  summary.files.push_back(text);
  return summary;
}

}  // namespace brainshift::client

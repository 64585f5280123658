// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <charconv>

#include "client/tools/stereo/jobs.hpp"
#include "client/tools/stereo/pictures.hpp"
#include "common/io/config/calibration_file.hpp"

namespace brainshift::client {
namespace {

// "9x6"
Result<stereo::ChessBoard> parse_board(const std::string& text, double square_mm) {
  stereo::ChessBoard board;
  board.square_mm = square_mm;
  const char* end = text.data() + text.size();
  const auto [cross, wrong] = std::from_chars(text.data(), end, board.columns);
  if (wrong == std::errc() && cross != end && *cross == 'x') {
    const auto [stop, error] = std::from_chars(cross + 1, end, board.rows);
    if (error == std::errc() && stop == end) return board;
  }
  return fail(ErrorCode::kInvalidArgument,
              fmt::format("--board {}: must be inner corners along and across, e.g. 9x6", text));
}

}  // namespace

Result<stereo::CalibrationResult> calibrate_files(const CalibrateJob& job,
                                                  const Progress& progress) {
  const auto board = parse_board(job.board, job.square_mm);
  if (!board) return tl::unexpected(board.error());
  if (Status ok = stereo::validate(*board); !ok) return tl::unexpected(ok.error());
  const auto left = expand_patterns(job.left);
  if (!left) return tl::unexpected(left.error());
  const auto right = expand_patterns(job.right);
  if (!right) return tl::unexpected(right.error());
  if (left->size() != right->size()) {
    return fail(
        ErrorCode::kInvalidArgument,
        fmt::format("{} left and {} right pictures: must be as many", left->size(), right->size()));
  }
  std::vector<stereo::PicturePair> pairs;
  for (std::size_t i = 0; i < left->size(); ++i) {
    report(progress, "read pictures", static_cast<double>(i) / static_cast<double>(left->size()));
    auto first = read_picture((*left)[i]);
    if (!first) return tl::unexpected(first.error());
    auto second = read_picture((*right)[i]);
    if (!second) return tl::unexpected(second.error());
    pairs.push_back({(*left)[i].filename().string(), std::move(*first), std::move(*second)});
  }
  report(progress, "read pictures", 1.0);
  report(progress, "calibrate", 0.0);
  auto result = stereo::calibrate(pairs, *board);
  if (!result) return result;
  if (Status ok = io::write_calibration(job.out, result->calibration); !ok)
    return tl::unexpected(ok.error());
  report(progress, "calibrate", 1.0);
  return result;
}

}  // namespace brainshift::client

// SPDX-License-Identifier: GPL-3.0-or-later
// The tracer against noise: a virtual sweep over an ellipsoid of known place, from one seed, with
// more and more speckle. Independent reference: the ellipsoid's own equation. Speed: time of a
// traced image over that of its smoothing.
#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "common/core/stopwatch.hpp"
#include "common/ultrasound/lesion_tracer.hpp"
#include "tests/support/study_record.hpp"
#include "tests/support/virtual_sweep.hpp"

namespace brainshift {
namespace {

using test_support::record;
using test_support::record_check;

constexpr const char* kStudy = "tracing";
constexpr double kPixel_mm = 0.25;  // the larger side

tracking::Recording recording_of(const test_support::VirtualSweep& sweep) {
  const auto content = sweep.content();
  tracking::Recording recording;
  recording.width = content.width, recording.height = content.height;
  recording.pixels = content.pixels;
  for (int i = 0; i < sweep.frames; ++i) {
    recording.time_s.push_back(sweep.period_s * i);
    recording.image_ok.push_back(1);
  }
  return recording;
}

struct Traced {
  int frames = 0;
  double median_mm = 0.0, p95_mm = 0.0, ms_per_frame = 0.0;
};

Traced trace(const test_support::VirtualSweep& sweep, const tracking::Recording& recording) {
  const Stopwatch watch;
  const auto found = ultrasound::trace_sweep(
      recording, {sweep.frames / 2, {0.5 * (sweep.width - 1), 0.5 * (sweep.height - 1)}});
  const double ms = watch.milliseconds();
  Traced traced;
  if (!found) return traced;
  std::vector<double> errors;
  for (const auto& each : found->contours) {
    const auto points =
        ultrasound::boundary_points(each.contour, sweep.T_ras_image(each.contour.frame));
    if (!points) continue;
    for (Eigen::Index i = 0; i < points->cols(); ++i)
      errors.push_back(sweep.distance_mm(points->col(i)));
  }
  if (errors.empty()) return traced;
  std::sort(errors.begin(), errors.end());
  traced.frames = static_cast<int>(found->contours.size());
  traced.median_mm = errors[errors.size() / 2];
  traced.p95_mm = errors[errors.size() * 95 / 100];
  traced.ms_per_frame = ms / traced.frames;
  return traced;
}

void study_noise() {
  for (int step = 0; step <= 10; ++step) {
    test_support::VirtualSweep sweep;
    sweep.speckle = 0.1 * step;
    const Traced traced = trace(sweep, recording_of(sweep));
    fmt::print(
        "noise {:.1f}: {} of {} frames traced; error median {:.3f} mm p95 {:.3f} mm; {:.2f} ms a "
        "frame\n",
        sweep.speckle, traced.frames, sweep.frames, traced.median_mm, traced.p95_mm,
        traced.ms_per_frame);
    const char* x = "noise sd over grey value";
    record({kStudy, "frames traced of 21", x, "frames", sweep.speckle, double(traced.frames)});
    if (traced.frames == 0) continue;
    record({"tracing_error", "median", x, "distance to the ellipsoid mm", sweep.speckle,
            traced.median_mm});
    record({"tracing_error", "95th percentile", x, "distance to the ellipsoid mm", sweep.speckle,
            traced.p95_mm});
    if (step == 2 || step == 4) {
      record_check(kStudy, fmt::format("median distance at noise {:.1f} mm", sweep.speckle),
                   traced.median_mm, "<= 0.25 (a pixel)", traced.median_mm <= kPixel_mm,
                   "equation of the ellipsoid");
      record_check(kStudy, fmt::format("frames traced at noise {:.1f}", sweep.speckle),
                   traced.frames, "= 21", traced.frames == 21, "every plane cuts the ellipsoid");
    }
  }
}

// A lesion that differs less and less from its surroundings. The tracer must lose it rather than
// trace it wrongly, and trace it at the largest difference.
void study_contrast() {
  double worst_mm = 0.0;
  int frames_at_largest = 0;
  for (int difference = 5; difference <= 60; difference += 5) {
    test_support::VirtualSweep sweep;
    sweep.outside = 80.0, sweep.inside = 80.0 + difference;
    sweep.speckle = 0.4;
    const Traced traced = trace(sweep, recording_of(sweep));
    fmt::print(
        "difference {} of 80 grey values at noise 0.4: {} frames; error median {:.3f} mm p95 "
        "{:.3f} mm\n",
        difference, traced.frames, traced.median_mm, traced.p95_mm);
    const char* x = "grey values above surroundings of 80";
    record({"tracing_contrast", "frames traced of 21", x, "frames", double(difference),
            double(traced.frames)});
    frames_at_largest = traced.frames;
    if (traced.frames == 0) continue;
    record({"tracing_contrast_error", "median", x, "distance to the ellipsoid mm",
            double(difference), traced.median_mm});
    record({"tracing_contrast_error", "95th percentile", x, "distance to the ellipsoid mm",
            double(difference), traced.p95_mm});
    worst_mm = std::max(worst_mm, traced.median_mm);
  }
  record_check(kStudy, "worst median distance of what is traced at low contrast mm", worst_mm,
               "<= 0.5 (two pixels)", frames_at_largest > 0 && worst_mm <= 2.0 * kPixel_mm,
               "equation of the ellipsoid");
}

// Images without a lesion: every contour is invented.
void study_empty_images() {
  int invented = 0;
  for (int level = 1; level <= 10; ++level) {
    test_support::VirtualSweep sweep;
    sweep.inside = sweep.outside;
    sweep.speckle = 0.1 * level;
    const tracking::Recording recording = recording_of(sweep);
    for (int frame = 0; frame < sweep.frames; ++frame) {
      if (ultrasound::trace_lesion(recording, {frame, {90, 80}})) ++invented;
    }
  }
  fmt::print("images without a lesion: {} of 210 traced\n", invented);
  record_check(kStudy, "contours invented on 210 images of noise", invented, "= 0", invented == 0,
               "there is nothing to trace");
}

void study_speed() {
  test_support::VirtualSweep sweep;
  sweep.speckle = 0.2;
  const tracking::Recording recording = recording_of(sweep);
  const Stopwatch watch;
  for (int frame = 0; frame < sweep.frames; ++frame)
    ultrasound::smoothed_frame(recording, frame, 2.0);
  const double smoothing_ms = watch.milliseconds() / sweep.frames;
  const double traced_ms = trace(sweep, recording).ms_per_frame;
  fmt::print("a traced image takes {:.1f} times its smoothing ({:.3f} ms)\n",
             traced_ms / smoothing_ms, smoothing_ms);
}

}  // namespace
}  // namespace brainshift

int main() {
  brainshift::study_noise();
  brainshift::study_contrast();
  brainshift::study_empty_images();
  brainshift::study_speed();
  return 0;
}

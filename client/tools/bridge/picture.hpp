// SPDX-License-Identifier: GPL-3.0-or-later
// Picture: what OpenIGTLink clients are shown at one moment; ShownState: what is to be known of it,
// in the forms in which they get it; and the lines that `brainshift bridge` prints of it.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/lib/field_status.hpp"
#include "common/core/error.hpp"
#include "common/igtl/header.hpp"
#include "common/igtl/image.hpp"
#include "common/igtl/metadata.hpp"
#include "common/igtl/poly_data.hpp"
#include "common/igtl/short_contents.hpp"
#include "common/values/estimate.hpp"

namespace brainshift::client {

// Clients get it as a JSON text (STRING), as metadata of every message (version 2), and as a
// STATUS.
struct ShownState {
  std::uint64_t sequence = 0;    // of the update that is shown; 0: none is
  std::uint64_t session_id = 0;  // 0: no session runs, or none is known
  std::string model_id;          // that the mesh and the grid belong to; empty: none loaded yet
  std::string case_id;
  std::string quality = "none";  // good, caution, unusable, none
  std::string flags;             // "data_outside_region+late"; empty: none is set
  Currency currency = Currency::kNone;
  std::string reason;  // one sentence for people; empty when current
  double age_ms = std::numeric_limits<double>::quiet_NaN();  // NaN: not known
  bool recorded = false;       // a recording is played: the field is not the patient's now
  std::string method;          // of the session; empty without one
  std::string boundary;        // of the session; empty without one
  bool blank = true;           // the volumes are zero, the surfaces undeformed
  bool has_sd = false;         // the field came with standard deviations
  bool has_known = false;      // and with how much of it is known
  double grid_error_mm = 0.0;  // of trilinear interpolation at the mesh's nodes
  double spacing_mm = 0.0;     // of the grid; 0: there is none yet
  double fade_mm = 0.0;        // before the rim; the field is exact farther inside only

  // The field may be used: it is shown, current, live, and judged good or with caution.
  bool usable() const { return !blank && currency == Currency::kCurrent && !recorded; }
};

// Names of the quality's flags that are set, and "late" for an answer that was, joined by "+".
std::string flag_names(const Update& update);

// Keys sequence, session_id, model_id, case_id, quality, flags, currency, reason, age_ms (null
// when not known), direction ("modeling"), recorded, method, boundary, blank, has_sd, has_known,
// grid_error_mm, spacing_mm, fade_mm. UTF-8; bytes that are none are replaced.
std::string to_json(const ShownState& state);
// The same keys; a number as JSON writes it, an unknown age as "unknown".
igtl::Metadata to_metadata(const ShownState& state);
// Code 1 when usable(), with the flags of one to be used with caution; else 13 with the reason.
igtl::StatusReport to_status(const ShownState& state);

// Surfaces that are shown. Falx and tentorium are fixed sheets: they stay where they are.
enum class Shape { kTumour, kCortex, kVentricles, kSepta };
inline constexpr std::array kShapes = {Shape::kTumour, Shape::kCortex, Shape::kVentricles,
                                       Shape::kSepta};
class Surfaces {
 public:
  std::optional<igtl::PolyData>& operator[](Shape shape) {
    return data_[static_cast<std::size_t>(shape)];
  }
  const std::optional<igtl::PolyData>& operator[](Shape shape) const {
    return data_[static_cast<std::size_t>(shape)];
  }

 private:
  std::array<std::optional<igtl::PolyData>, kShapes.size()> data_;
};

// What stays the same for as long as the model does.
struct Rest {
  igtl::ImageGeometry geometry;
  bool with_sd = true;  // volumes and attributes sd_mm and known
  // Undeformed, with attributes of zeros; those that the model has, none when they are not wanted.
  Surfaces surfaces;
};

// A value that is not changed any more once it is made; the threads share it.
struct Picture {
  ShownState state;
  igtl::Timestamp time = 0;  // when it was made
  // Null: no model is known yet, and there is nothing but the state.
  std::shared_ptr<const Rest> rest;
  // Empty when blank, which stands for zeros.
  std::vector<float> u;      // 3 per voxel, mm
  std::vector<float> sd;     // 1 per voxel, mm
  std::vector<float> known;  // 1 per voxel, 0 to 1
  Surfaces surfaces;         // deformed; where empty, as at rest
};
using PicturePtr = std::shared_ptr<const Picture>;

// Now, by the wall clock.
igtl::Timestamp time_now();
// Zeros, and the surfaces as they were before surgery. state.blank and its figures of a field are
// set to say so; session, model, case, currency, quality and reason are the caller's.
PicturePtr blank_picture(const std::shared_ptr<const Rest>& rest, ShownState state);

// A line for every field that is shown.
struct ShownLine {
  ShownState state;
  std::array<int, 3> dims{0, 0, 0};
  double made_ms = 0.0;  // sampling the grid and moving the surfaces
  int clients = 0;
  std::uint64_t replaced = 0;  // pictures that slow clients did not get, so far
};

// "update 12  age 0.08 s  good, current  62 x 58 x 60 voxels, 2 mm, error 0.11 mm  4.2 ms
//  2 clients"; json: an object with the event "update".
std::string shown_line(const ShownLine& line, bool json);
// The sentence itself; json: an object with the event "note".
std::string note_line(const std::string& sentence, bool json);

}  // namespace brainshift::client

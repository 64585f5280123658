// SPDX-License-Identifier: GPL-3.0-or-later
// ShownState: what is to be known of the field that OpenIGTLink clients are shown, in the three
// forms in which they get it: a JSON text (STRING), metadata of every message (version 2), and a
// STATUS.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <string_view>

#include "client/lib/field_status.hpp"
#include "common/core/error.hpp"
#include "common/igtl/metadata.hpp"
#include "common/igtl/short_contents.hpp"
#include "common/values/estimate.hpp"

namespace brainshift::client {

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
  bool blank = true;           // the volumes are zero, the surfaces undeformed
  bool has_sd = false;         // the field came with standard deviations
  double grid_error_mm = 0.0;  // of trilinear interpolation at the mesh's nodes
  double spacing_mm = 0.0;     // of the grid; 0: there is none yet
  double fade_mm = 0.0;        // before the rim; the field is exact farther inside only

  // The field may be used: it is shown, current, and judged good or with caution.
  bool usable() const { return !blank && currency == Currency::kCurrent; }
};

// Names of the quality's flags that are set, and "late" for an answer that was, joined by "+".
std::string flag_names(const Update& update);

// Keys sequence, session_id, model_id, case_id, quality, flags, currency, reason, age_ms (null when
// not known), direction ("modeling"), blank, has_sd, grid_error_mm, spacing_mm, fade_mm. UTF-8;
// bytes that are none are replaced.
std::string to_json(const ShownState& state);
// The same keys; a number as JSON writes it, an unknown age as "unknown".
igtl::Metadata to_metadata(const ShownState& state);
// Code 1 when usable(), else 13 with the reason.
igtl::StatusReport to_status(const ShownState& state);

}  // namespace brainshift::client

// SPDX-License-Identifier: GPL-3.0-or-later
// A head meshed at a wanted size and prepared for every inversion method, and what that cost.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "common/configuration/case_config.hpp"
#include "common/core/error.hpp"
#include "common/core/progress.hpp"
#include "common/geometry/tet_locator.hpp"
#include "common/inversion/prepared/prepared_model.hpp"
#include "common/operators/condensed_operators.hpp"
#include "common/values/brain_model.hpp"
#include "tests/benchmarks/csv_table.hpp"

namespace brainshift::bench {

struct MeshWish {
  std::string name;            // "18k", "18k-refined"
  double thousand_nodes = 18;  // wanted; mesh_row() has the count that came out
  double local_factor = 1.0;   // edges at tumour and craniotomy, in units of the edge elsewhere
};

struct Head {
  std::string name;
  CaseConfig config;
  std::shared_ptr<const BrainModel> model;
  std::shared_ptr<const inversion::PreparedModel> prepared;
  std::shared_ptr<const CondensedOperators> operators;
  std::shared_ptr<const geometry::TetLocator> locator;
  double mesh_s = 0.0, condense_s = 0.0;
  std::uint64_t peak_rss_bytes = 0;  // of this process, from the mesh to the condensed operators
};

// Scales all three edges of the case by (nodes of the unscaled case / wanted nodes)^(1/3).
// kInvalidArgument when the case names a ready mesh.
Status scale_edges(CaseConfig& config, const MeshWish& wish);

// `config` as read from the case file, with scale_edges() still to be applied.
Result<Head> make_head(CaseConfig config, const MeshWish& wish, const Progress& progress = {});

// meshes-*.csv
inline constexpr const char* kMeshHeading =
    "mesh,nodes,tets,slaves,edge_mm,tumour_edge_mm,modes,mesh_s,factor_s,prepare_s,t_solve_ms,"
    "condense_s,operator_bytes,factor_bytes,peak_rss_bytes";
std::vector<std::string> mesh_row(const Head& head);

}  // namespace brainshift::bench

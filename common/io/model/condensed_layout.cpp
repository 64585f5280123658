// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/model/condensed_layout.hpp"

#include <algorithm>

#include "common/io/model/condensed_check.hpp"

namespace brainshift::io {
namespace {

std::string group_of(Boundary boundary) { return "condensed/" + std::string(to_string(boundary)); }

Eigen::Index packed_size(Eigen::Index n) { return n * (n + 1) / 2; }

// Columns of the lower triangle one after the other: n, n-1, ..., 1 numbers.
VecX packed_lower(const Eigen::MatrixXd& matrix) {
  const Eigen::Index n = matrix.cols();
  VecX packed(packed_size(n));
  Eigen::Index at = 0;
  for (Eigen::Index j = 0; j < n; ++j) {
    packed.segment(at, n - j) = matrix.col(j).tail(n - j);
    at += n - j;
  }
  return packed;
}

// The packed numbers are read into the end of the matrix's own memory and spread from its
// beginning: column j goes to [jn + j, (j+1)n) and comes from n(n-1)/2 + jn - j(j-1)/2, which is
// never before its target and lies behind all columns already spread.
void read_symmetric(const Hdf5Reader& in, const std::string& name, Eigen::Index n,
                    Eigen::MatrixXd& out) {
  out.resize(n, n);
  double* source = out.data() + n * n - packed_size(n);
  in.list_into(name, source, static_cast<std::size_t>(packed_size(n)));
  for (Eigen::Index j = 0; j < n; ++j) {
    std::copy(source, source + (n - j), out.data() + j * n + j);
    source += n - j;
  }
  // Upper triangle in tiles that stay in the cache, else every number costs a cache line.
  constexpr Eigen::Index kTile = 64;
  for (Eigen::Index j = 0; j < n; j += kTile) {
    for (Eigen::Index i = 0; i <= j; i += kTile) {
      for (Eigen::Index b = j; b < std::min(n, j + kTile); ++b) {
        for (Eigen::Index a = i; a < std::min(b, i + kTile); ++a) out(a, b) = out(b, a);
      }
    }
  }
}

std::string modes_of(int part) {
  return std::string(to_string(static_cast<PriorPart>(part))) + "_modes";
}

void write_compact(Hdf5Writer& out, const std::string& group, const CompactParts& parts) {
  const std::string in_group = group + "/";
  out.group(group);
  out.list(in_group + "steps", parts.steps);
  out.list(in_group + "order", parts.order);
  out.matrix(in_group + "blocks", parts.blocks);
  out.list(in_group + "wide_basis", parts.wide_basis);
  out.list(in_group + "basis", parts.basis);
  out.list(in_group + "basis_scales", parts.basis_scales);
  out.list(in_group + "lengths", parts.lengths);
  out.list(in_group + "longs", parts.longs);
  out.list(in_group + "words", parts.words);
  out.list(in_group + "bytes", parts.bytes);
}

// The numbers are read to where they stay.
CompactColumns read_compact(const Hdf5Reader& in, const std::string& group) {
  const std::string in_group = group + "/";
  CompactParts parts;
  in.matrix(in_group + "steps", parts.steps);
  parts.order = in.list<int>(in_group + "order");
  in.matrix(in_group + "blocks", parts.blocks);
  in.matrix(in_group + "wide_basis", parts.wide_basis);
  in.matrix(in_group + "basis", parts.basis);
  in.matrix(in_group + "basis_scales", parts.basis_scales);
  in.matrix(in_group + "lengths", parts.lengths);
  in.matrix(in_group + "longs", parts.longs);
  in.matrix(in_group + "words", parts.words);
  in.matrix(in_group + "bytes", parts.bytes);
  auto columns = CompactColumns::from_parts(std::move(parts));
  if (!columns) throw Hdf5Problem{in_group + columns.error().message};
  return std::move(*columns);
}

void write_one(Hdf5Writer& out, const CondensedOperators& operators) {
  const std::string group = group_of(operators.boundary);
  const std::string in_group = group + "/";
  out.group(group);
  out.attribute(group, "model_id", operators.model_id);
  for (int part = 0; part < kPriorParts; ++part) {
    out.number(group, modes_of(part), operators.part_columns[static_cast<std::size_t>(part)]);
  }
  out.number(group, "prepare_s", operators.prepare_s);
  write_compact(out, in_group + "responses", operators.responses.parts());
  out.list(in_group + "compliance_lower", packed_lower(operators.compliance));
  out.matrix(in_group + "slave_modes", operators.slave_modes);
  out.matrix(in_group + "slave_normals", operators.slave_normals);
  out.list(in_group + "initial_penetration_mm", operators.initial_penetration_mm);
  out.list(in_group + "slaves", operators.slaves);
  out.list(in_group + "region", operators.region);
  out.matrix(in_group + "region_responses", operators.region_responses);
  out.list(in_group + "control", operators.control);
  out.matrix(in_group + "truncated_variance_mm2", operators.truncated_variance_mm2);
  out.matrix(in_group + "control_neighbours", operators.control_neighbours);
  out.matrix(in_group + "control_weights", operators.control_weights);
}

CondensedOperators read_one(const Hdf5Reader& in, Boundary boundary) {
  const std::string group = group_of(boundary);
  const std::string in_group = group + "/";
  CondensedOperators operators;
  operators.boundary = boundary;
  operators.model_id = in.attribute_text(group, "model_id");
  for (int part = 0; part < kPriorParts; ++part) {
    operators.part_columns[static_cast<std::size_t>(part)] = in.number<int>(group, modes_of(part));
  }
  operators.prepare_s = in.number<double>(group, "prepare_s");
  operators.responses = read_compact(in, in_group + "responses");
  operators.slaves = in.list<int>(in_group + "slaves");
  read_symmetric(in, in_group + "compliance_lower",
                 static_cast<Eigen::Index>(operators.slaves.size()), operators.compliance);
  in.matrix(in_group + "slave_modes", operators.slave_modes);
  in.matrix(in_group + "slave_normals", operators.slave_normals);
  in.matrix(in_group + "initial_penetration_mm", operators.initial_penetration_mm);
  operators.region = in.list<int>(in_group + "region");
  in.matrix(in_group + "region_responses", operators.region_responses);
  operators.control = in.list<int>(in_group + "control");
  in.matrix(in_group + "truncated_variance_mm2", operators.truncated_variance_mm2);
  in.matrix(in_group + "control_neighbours", operators.control_neighbours);
  in.matrix(in_group + "control_weights", operators.control_weights);
  return operators;
}

}  // namespace

void write_condensed(Hdf5Writer& out, const std::vector<CondensedOperators>& operators) {
  out.group("condensed");
  for (const CondensedOperators& each : operators) write_one(out, each);
}

std::vector<CondensedOperators> read_condensed(const Hdf5Reader& in, const BrainModel& model,
                                               const std::vector<Boundary>& wanted) {
  std::vector<CondensedOperators> all;
  for (const Boundary boundary : wanted) {
    if (!in.has(group_of(boundary))) continue;
    all.push_back(read_one(in, boundary));
    if (const auto problem = incompatibility_of(all.back(), model)) throw Hdf5Problem{*problem};
  }
  return all;
}

}  // namespace brainshift::io

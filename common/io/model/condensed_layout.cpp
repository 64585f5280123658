// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/model/condensed_layout.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "common/core/thread_team.hpp"

namespace brainshift::io {
namespace {

// ---- whether operators can be used with a model ----

// A number is finite unless all bits of its exponent are set. Whole-number arithmetic without
// branches, so that the compiler vectorises it: the loop runs as fast as memory.
template <typename T>
bool finite(const T* values, std::size_t count) {
  constexpr bool kSingle = std::is_same_v<T, float>;
  using Bits = std::conditional_t<kSingle, std::uint32_t, std::uint64_t>;
  constexpr auto kExponent = static_cast<Bits>(kSingle ? 0x7f800000u : 0x7ff0000000000000u);
  Bits bad = 0;
  for (std::size_t i = 0; i < count; ++i) {
    Bits bits;
    std::memcpy(&bits, values + i, sizeof bits);
    bad |= (bits & kExponent) == kExponent ? 1u : 0u;
  }
  return bad == 0;
}

constexpr Eigen::Index kWorthThreads = 1 << 20;

template <typename Matrix>
bool all_finite(const Matrix& values) {
  std::atomic<bool> good{true};
  ThreadTeam team(values.size() < kWorthThreads ? 1 : 0);
  team.split(static_cast<long>(values.size()), [&](long begin, long end) {
    if (!finite(values.data() + begin, static_cast<std::size_t>(end - begin))) good = false;
  });
  return good;
}

// Collects the first thing that is wrong.
class Check {
 public:
  explicit Check(Boundary boundary)
      : group_("condensed/" + std::string(to_string(boundary)) + "/") {}

  void that(bool holds, const std::string& name, const std::string& problem) {
    if (!holds && !found_) found_ = group_ + name + " " + problem;
  }
  template <typename Matrix>
  void matrix(const std::string& name, const Matrix& values, Eigen::Index rows,
              Eigen::Index columns) {
    // Without slaves or control nodes, an array has no numbers and any shape is as good.
    const bool fits = (values.rows() == rows && values.cols() == columns) ||
                      (values.size() == 0 && rows * columns == 0);
    that(fits, name,
         "is " + shape(values.rows(), values.cols()) + ": must be " + shape(rows, columns));
    if constexpr (!std::is_same_v<typename Matrix::Scalar, int>) {
      if (!found_) that(all_finite(values), name, "holds a number that is not finite");
    }
  }
  // Indices below `limit`.
  void nodes(const std::string& name, const std::vector<NodeIndex>& list, Eigen::Index limit) {
    that(std::all_of(list.begin(), list.end(), [&](int i) { return i >= 0 && i < limit; }), name,
         "names a node that the mesh does not have");
  }
  // The same, each once and in increasing order.
  void sorted_nodes(const std::string& name, const std::vector<NodeIndex>& list,
                    Eigen::Index limit) {
    that(std::adjacent_find(list.begin(), list.end(), [](int a, int b) { return a >= b; }) ==
             list.end(),
         name, "is not sorted");
    nodes(name, list, limit);
  }
  std::optional<std::string> found() const { return found_; }

 private:
  static std::string shape(Eigen::Index rows, Eigen::Index columns) {
    return std::to_string(rows) + " x " + std::to_string(columns);
  }
  std::string group_;
  std::optional<std::string> found_;
};

bool symmetric(const Eigen::MatrixXd& matrix) {
  constexpr Eigen::Index kTile = 64;  // both tiles stay in the cache
  const Eigen::Index n = matrix.cols();
  for (Eigen::Index j = 0; j < n; j += kTile) {
    for (Eigen::Index i = 0; i <= j; i += kTile) {
      const Eigen::Index rows = std::min(kTile, n - i), columns = std::min(kTile, n - j);
      if (matrix.block(i, j, rows, columns) != matrix.block(j, i, columns, rows).transpose()) {
        return false;
      }
    }
  }
  return true;
}

// As often as they are: a slave of the skull may be one of a sheet too, or of two sheets.
bool are_slaves(std::vector<NodeIndex> list, std::vector<NodeIndex> slaves) {
  std::sort(list.begin(), list.end());
  std::sort(slaves.begin(), slaves.end());
  return std::includes(slaves.begin(), slaves.end(), list.begin(), list.end());
}

// ---- the group in the file ----

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

// array(name, values) for each array, in the order of the file.
template <typename Array, typename Parts>
void visit_compact(const Array& array, Parts& parts) {
  array("steps", parts.steps);
  array("order", parts.order);
  array("blocks", parts.blocks);
  array("wide_basis", parts.wide_basis);
  array("basis", parts.basis);
  array("basis_scales", parts.basis_scales);
  array("lengths", parts.lengths);
  array("longs", parts.longs);
  array("words", parts.words);
  array("bytes", parts.bytes);
}

// The same for those behind the responses and the compliance.
template <typename Array, typename Operators>
void visit_operators(const Array& array, Operators& operators) {
  array("slave_modes", operators.slave_modes);
  array("slave_normals", operators.slave_normals);
  array("initial_penetration_mm", operators.initial_penetration_mm);
  array("slaves", operators.slaves);
  array("region", operators.region);
  array("region_responses", operators.region_responses);
  array("control", operators.control);
  array("truncated_variance_mm2", operators.truncated_variance_mm2);
  array("control_neighbours", operators.control_neighbours);
  array("control_weights", operators.control_weights);
}

// Arrays into a group, or out of it; the numbers are read to where they stay.
auto into(Hdf5Writer& out, const std::string& group) {
  return [&out, group](const char* name, const auto& values) {
    out.write(group + "/" + name, values);
  };
}
auto out_of(const Hdf5Reader& in, const std::string& group) {
  return [&in, group](const char* name, auto& values) { in.read(group + "/" + name, values); };
}

void write_one(Hdf5Writer& out, const CondensedOperators& operators) {
  const std::string group = group_of(operators.boundary);
  out.group(group);
  out.attribute(group, "model_id", operators.model_id);
  for (int part = 0; part < kPriorParts; ++part) {
    out.number(group, modes_of(part), operators.part_columns[static_cast<std::size_t>(part)]);
  }
  out.number(group, "prepare_s", operators.prepare_s);
  out.group(group + "/responses");
  visit_compact(into(out, group + "/responses"), operators.responses.parts());
  out.write(group + "/compliance_lower", packed_lower(operators.compliance));
  visit_operators(into(out, group), operators);
}

CondensedOperators read_one(const Hdf5Reader& in, Boundary boundary) {
  const std::string group = group_of(boundary);
  CondensedOperators operators;
  operators.boundary = boundary;
  operators.model_id = in.attribute_text(group, "model_id");
  for (int part = 0; part < kPriorParts; ++part) {
    operators.part_columns[static_cast<std::size_t>(part)] = in.number<int>(group, modes_of(part));
  }
  operators.prepare_s = in.number<double>(group, "prepare_s");
  CompactParts parts;
  visit_compact(out_of(in, group + "/responses"), parts);
  auto columns = CompactColumns::from_parts(std::move(parts));
  if (!columns) throw Hdf5Problem{group + "/responses/" + columns.error().message};
  operators.responses = std::move(*columns);
  visit_operators(out_of(in, group), operators);
  read_symmetric(in, group + "/compliance_lower",
                 static_cast<Eigen::Index>(operators.slaves.size()), operators.compliance);
  return operators;
}

}  // namespace

std::optional<std::string> incompatibility_of(const CondensedOperators& operators,
                                              const BrainModel& model) {
  const Eigen::Index n = model.mesh.num_nodes();
  const auto s = static_cast<Eigen::Index>(operators.slaves.size());
  const Eigen::Index r = operators.responses.num_columns() - s;
  const auto c = static_cast<Eigen::Index>(operators.control.size());
  Check check(operators.boundary);
  check.that(operators.model_id == model.model_id, "model_id",
             "is '" + operators.model_id + "': the operators belong to another model than '" +
                 model.model_id + "'");
  check.nodes("slaves", operators.slaves, n);
  std::vector<NodeIndex> slaves = model.slaves;
  slaves.insert(slaves.end(), model.septa.slaves.begin(), model.septa.slaves.end());
  check.that(are_slaves(operators.slaves, std::move(slaves)), "slaves",
             "names a node that is no slave of the model, or more often than it is one");
  check.sorted_nodes("region", operators.region, n);
  check.sorted_nodes("control", operators.control, n);
  check.that(operators.num_nodes() == n, "responses",
             fmt::format("has {} nodes: must have {}", operators.num_nodes(), n));
  check.that(r >= 0, "responses",
             fmt::format("has {} columns: fewer than the {} slaves", r + s, s));
  check.matrix("region_responses", operators.region_responses,
               3 * static_cast<Eigen::Index>(operators.region.size()), r + s);
  int left = static_cast<int>(r);
  for (int part = 0; part < kPriorParts; ++part) {
    const int columns = operators.part_columns[static_cast<std::size_t>(part)];
    check.that(columns >= 0 && columns <= left, modes_of(part),
               fmt::format("= {}: must be from 0 to the {} modes that the parts before it leave",
                           columns, left));
    left -= std::max(0, columns);
  }
  check.that(left == 0, "responses", fmt::format("has {} columns of no part of the prior", left));
  check.matrix("compliance", operators.compliance, s, s);
  if (!check.found()) check.that(symmetric(operators.compliance), "compliance", "is not symmetric");
  check.that(operators.num_modes() == r, "slave_modes",
             fmt::format("has {} columns: must have {}", operators.num_modes(), r));
  check.matrix("slave_modes", operators.slave_modes, s, r);
  check.matrix("slave_normals", operators.slave_normals, 3, s);
  check.matrix("initial_penetration_mm", operators.initial_penetration_mm, s, 1);
  check.matrix("truncated_variance_mm2", operators.truncated_variance_mm2, c, kRemainders);
  check.matrix("control_neighbours", operators.control_neighbours, 4, c == 0 ? 0 : n);
  check.matrix("control_weights", operators.control_weights, 4, c == 0 ? 0 : n);
  const auto& neighbours = operators.control_neighbours;
  check.that(neighbours.size() == 0 || (neighbours.minCoeff() >= 0 && neighbours.maxCoeff() < c),
             "control_neighbours", "names a control node that does not exist");
  return check.found();
}

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

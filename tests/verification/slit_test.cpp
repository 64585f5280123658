// SPDX-License-Identifier: GPL-3.0-or-later
// A slit with a rigid sheet against CalculiX: the same mesh, elements and load, its own contact of
// nodes with faces (tests/evidence/calculix/slit.inp). What it found is kept as slit.csv beside the
// deck (`make calculix`).
#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/results.hpp"
#include "tests/support/slit_block.hpp"
#include "tests/support/study_record.hpp"

namespace brainshift::verification {
namespace {

struct Field {
  Points nodes, u;
};

Field calculix_field(int count) {
  Field field{Points(3, count), Points(3, count)};
  std::ifstream in(BRAINSHIFT_SLIT_FIELD);
  for (int n = 0; n < count; ++n) {
    char comma = 0;
    for (int k = 0; k < 6; ++k) {
      in >> (k < 3 ? field.nodes(k, n) : field.u(k - 3, n));
      if (k < 5) in >> comma;
    }
  }
  EXPECT_TRUE(in.good()) << BRAINSHIFT_SLIT_FIELD;
  return field;
}

TEST(Slit, MovesAsInCalculix) {
  const BrainModel model = test_support::partly_slit_block();
  const auto forward = value_or_fail(test_support::on_rollers(model));
  const Points u = value_or_fail(
      test_support::equilibrium(forward, test_support::load_of_partly_slit_block(model.mesh)));
  const Field reference = calculix_field(model.mesh.num_nodes());
  ASSERT_LT((reference.nodes - model.mesh.nodes).colwise().norm().maxCoeff(), 1e-3);

  // Part of either side presses, part does not: the set is not given by the load's sign.
  const auto presses = forward.contact().penetrating(u);
  int left = 0, right = 0, of_left = 0, of_right = 0;
  for (std::size_t i = 0; i < presses.size(); ++i) {
    const bool on_right = model.septa.normals(0, static_cast<Eigen::Index>(i)) > 0.0;
    (on_right ? of_right : of_left) += 1;
    if (presses[i] != 0) (on_right ? right : left) += 1;
  }
  EXPECT_TRUE(0 < left && left < of_left) << left << " of " << of_left;
  EXPECT_TRUE(0 < right && right < of_right) << right << " of " << of_right;

  const double largest = reference.u.colwise().norm().maxCoeff();
  const double apart = (u - reference.u).colwise().norm().maxCoeff() / largest;
  EXPECT_TRUE(test_support::record_check("slit", "largest difference over largest displacement",
                                         apart, "<= 1e-3", apart <= 1e-3,
                                         "CalculiX 2.20; contact of nodes with faces"));
  test_support::record_figure("slit", "largest displacement mm", largest, "shown", "CalculiX 2.20");
  test_support::record_figure("slit", "nodes that press", left + right,
                              "of " + std::to_string(presses.size()), "contact set");
}

}  // namespace
}  // namespace brainshift::verification

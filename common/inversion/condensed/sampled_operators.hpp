// SPDX-License-Identifier: GPL-3.0-or-later
// SampledOperators: the operators at the data of one update, whitened by their standard deviation.
//
//   free_body   R^-1/2 [common error | A U | d]     rows x (q + r + 1)
//   contact     R^-1/2 A G_A         rows x k
// A whole displacement has three rows, a datum along a direction n one, n . (A U) and so on; R
// holds sd^2 / weight. Rows of U and G in the data region are at hand. Where a datum
// touches another node, the rows of all nodes that data touch are unpacked when they are located,
// and what the modes leave out of the prior there is added to the datum's variance
// (CondensedOperators::truncated_variance_mm2), so that it is not believed too much. Does not
// allocate after reserve() as long as data lie in the region.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/configuration/case_config.hpp"
#include "common/core/error.hpp"
#include "common/core/thread_team.hpp"
#include "common/geometry/tet_locator.hpp"
#include "common/inversion/skull/mode_window.hpp"
#include "common/linalg/blas.hpp"
#include "common/linalg/growing_matrix.hpp"
#include "common/operators/condensed_operators.hpp"
#include "common/values/sparse_data.hpp"

namespace brainshift::inversion {

// One number for each residual field of the prior.
using RemainderVariances = Eigen::Matrix<double, kRemainders, 1>;

class SampledOperators {
 public:
  SampledOperators(std::shared_ptr<const CondensedOperators> operators,
                   std::shared_ptr<const geometry::TetLocator> locator, ModeWindow window,
                   OutsideRegion outside, ThreadTeam& team);

  void reserve(int data);
  // Locates the data. kInvalidArgument for a datum farther than kOutsideTolerance_mm outside the
  // brain, or outside the region where the case refuses that (named). Preconditions: check_data;
  // reserve(data.size()).
  Status locate(const SparseData& data);
  // Fills free_body for the data that locate() was given. strengths_squared: of the prior's
  // residual fields, for what their modes leave out. weights: robust weight per datum, > 0.
  void sample(const SparseData& data, const RemainderVariances& strengths_squared,
              const Eigen::Ref<const VecX>& weights);
  int size() const { return size_; }
  int rows() const { return first_row_[static_cast<std::size_t>(size_)]; }
  int first_row(int datum) const { return first_row_[static_cast<std::size_t>(datum)]; }
  // Data whose variance depends on the strengths.
  int data_outside_region() const { return outside_region_; }
  int common() const { return common_; }  // q
  // SparseData::common_variance of the data that locate() was given.
  const linalg::GrowingMatrix& common_variance() const { return common_variance_; }
  // mm, with what the modes leave out and the robust weight.
  double sd(int datum) const { return sd_[datum]; }
  auto free_body() const { return free_body_.topLeftCorner(rows(), common_ + window_.count + 1); }
  // R^-1/2 A of the modes before the window (gravity modes that a scene leaves out), rows x
  // window.first.
  auto modes_before() const { return before_.topRows(rows()); }
  // R^-1/2 A G_A; valid until the next call.
  Eigen::Map<const Eigen::MatrixXd> contact(const std::vector<int>& active);
  // out -= R^-1/2 A G_A f; f: one force per active slave, N; out: rows.
  void subtract_contact(const std::vector<int>& active, const Eigen::Ref<const VecX>& forces,
                        VecX& out);
  // out = (R^-1/2 A G_A)^T v; v: rows; out: k.
  void contact_transposed(const std::vector<int>& active, const VecX& v, Eigen::Ref<VecX> out);

 private:
  // What the modes of each residual field leave out at unit strength, mm^2; false when every node
  // that counts was prepared.
  bool truncated_variance(const geometry::TetLocation& location, RemainderVariances& out) const;
  Status refuse(const SparseData& data, int datum, const std::string& where);
  // The rows of one datum in a column of rows().
  void put(const Vec3& value, int datum, double* column) const;
  using NodeWeights = Eigen::Matrix<double, 4, Eigen::Dynamic>;  // 4 x m
  // Unpacks the rows of all nodes that data touch.
  void unpack_outside();
  // out = A (array column), each datum's rows with its weights; `array` has the rows of
  // outside_nodes_ when any datum lies outside the region, else those of the region.
  void sample_column(const float* array, const NodeWeights& weights, double* out) const;
  // A G of these slaves, in contact_columns_ from now on.
  void sample_contact(const std::vector<int>& slaves);
  const double* contact_column(int slave) const {
    return contact_columns_.get() + static_cast<std::ptrdiff_t>(rows()) * slave;
  }

  std::shared_ptr<const CondensedOperators> operators_;
  std::shared_ptr<const geometry::TetLocator> locator_;
  ModeWindow window_;
  OutsideRegion outside_;
  ThreadTeam& team_;                      // shares the work
  std::vector<int> region_row_;           // per node, -1 outside the region
  std::vector<NodeIndex> outside_nodes_;  // sorted; with a datum outside the region
  Eigen::MatrixXf outside_modes_;         // 3 outside_nodes_.size() x (window.first + count)
  int size_ = 0, common_ = 0, capacity_ = 0, outside_region_ = 0;
  Eigen::Matrix<int, 4, Eigen::Dynamic> rows_;  // 4 x m, row of each node in the sampled array
  NodeWeights barycentric_, weights_;           // 4 x m; weights_: / sd
  linalg::GrowingMatrix common_variance_;       // q x hypotheses
  Points directions_;                           // 3 x m, zero: whole
  std::vector<int> first_row_;                  // m + 1
  Eigen::Matrix<double, kRemainders, Eigen::Dynamic> left_out_;  // at unit strength, mm^2
  VecX sd_;
  Eigen::MatrixXd free_body_, before_;
  VecX row_weights_, forced_;  // rows; R^-1/2, and what forces or adjoint make of it
  // A G, a column per slave, of those that have been asked for since locate(); whitened when used.
  std::unique_ptr<double[]> contact_columns_, whitened_contact_;
  std::vector<char> has_column_;  // by slave
  std::vector<int> missing_;
  std::vector<const double*> columns_;  // of subtract_contact()
};

}  // namespace brainshift::inversion

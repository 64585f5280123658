// SPDX-License-Identifier: GPL-3.0-or-later
// GrowingMatrix and GrowingVector: of changing size, with memory that only grows, for loops that
// must not allocate.
#pragma once

#include <Eigen/Core>
#include <new>
#include <vector>

namespace brainshift::linalg {

template <typename Plain>
class Growing : public Eigen::Map<Plain> {
 public:
  using View = Eigen::Map<Plain>;

  Growing() : View(nullptr, 0, Plain::IsVectorAtCompileTime ? 1 : 0) {}
  Growing(const Growing& other) : Growing() { *this = other; }
  Growing& operator=(const Growing& other) {
    storage_ = other.storage_;
    seat(other.rows(), other.cols());
    return *this;
  }
  // Allocates where it never was so large. The entries are undefined afterwards.
  void resize(Eigen::Index rows, Eigen::Index cols = 1) {
    const auto size = static_cast<std::size_t>(rows * cols);
    if (size > storage_.size()) storage_.resize(size);
    seat(rows, cols);
  }
  // Takes the shape of an expression that does not refer to this matrix, and its value.
  template <typename Expression>
  Growing& operator=(const Eigen::MatrixBase<Expression>& value) {
    resize(value.rows(), value.cols());
    View::operator=(value);
    return *this;
  }

 private:
  // A Map is moved to another place by constructing it anew, as Eigen's manual says.
  void seat(Eigen::Index rows, Eigen::Index cols) {
    new (static_cast<View*>(this)) View(storage_.data(), rows, cols);
  }
  std::vector<double> storage_;
};

// Another size, entries undefined. What there was is freed when the new memory is there, not before
// as by resize(): without memory the matrix stays as it was.
template <typename Plain>
void replace(Plain& matrix, Eigen::Index rows, Eigen::Index cols = 1) {
  Plain other(rows, cols);
  matrix.swap(other);
}

using GrowingMatrix = Growing<Eigen::MatrixXd>;
using GrowingVector = Growing<Eigen::VectorXd>;

}  // namespace brainshift::linalg

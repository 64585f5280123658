// SPDX-License-Identifier: Apache-2.0
#include "common/core/small_matrices.hpp"

#include <Eigen/Dense>
#include <limits>

namespace brainshift {
namespace {

template <int N>
SymmetricEigen<N> eigen_of(const Eigen::Matrix<double, N, N>& A) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, N, N>> solver(A);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

template <int N>
Eigen::Matrix<double, N, 1> eigenvalues_of(const Eigen::Matrix<double, N, N>& A) {
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, N, N>>(A, Eigen::EigenvaluesOnly)
      .eigenvalues();
}

}  // namespace

SymmetricEigen<3> symmetric_eigen(const Mat3& A) { return eigen_of<3>(A); }
SymmetricEigen<6> symmetric_eigen(const Mat6& A) { return eigen_of<6>(A); }
Vec3 symmetric_eigenvalues(const Mat3& A) { return eigenvalues_of<3>(A); }
Vec6 symmetric_eigenvalues(const Mat6& A) { return eigenvalues_of<6>(A); }

SingularValues singular_values(const Mat3& A) {
  const Eigen::JacobiSVD<Mat3> svd(A, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return {svd.matrixU(), svd.singularValues(), svd.matrixV()};
}

Mat3 least_norm_solution(const Mat3& A, const Mat3& B) {
  const SymmetricEigen<3> eigen = symmetric_eigen(A);
  const double rounding = 3.0 * std::numeric_limits<double>::epsilon() * eigen.values[2];
  Mat3 X = Mat3::Zero();
  for (int k = 0; k < 3; ++k) {
    if (!(eigen.values[k] > rounding)) continue;
    X += eigen.vectors.col(k) * ((eigen.vectors.col(k).transpose() * B) / eigen.values[k]);
  }
  return X;
}

Mat6 symmetric_inverse(const Mat6& A) { return A.ldlt().solve(Mat6::Identity()); }

}  // namespace brainshift

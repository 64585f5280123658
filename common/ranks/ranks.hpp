// SPDX-License-Identifier: GPL-3.0-or-later
// Ranks: processes that prepare one model together, as seen by one of them. Who implements it
// (common/mpi) knows how messages travel; nobody else does.
//
// Every call but rank() and size() is made by all processes, in the same order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/types.hpp"

namespace brainshift {

// A symmetric positive definite matrix A and right-hand sides that are sums over the processes.
// Lower triangle as (row, column, number), 0-based; entries of one place add up, also within a
// process.
struct SummedMatrix {
  int size = 0;
  std::vector<int> rows, columns;
  std::vector<double> values;
  std::vector<int> order;  // the unknowns in the order of elimination, the same everywhere
};
class SummedFactor {
 public:
  virtual ~SummedFactor() = default;
  // X = A^-1 B. b: what this process has of B, k x n, a right-hand side per row; x: the whole
  // solution, everywhere. kInternal.
  virtual Status solve(const Eigen::MatrixXd& b, Eigen::MatrixXd& x) = 0;
  virtual std::size_t bytes() const = 0;  // of the factor in this process
};

class Ranks {
 public:
  using Bytes = std::vector<std::byte>;

  virtual ~Ranks() = default;
  virtual int rank() const = 0;
  virtual int size() const = 0;

  // Sums over the processes, in place. All have the same bits afterwards.
  virtual void sum(std::span<double> numbers) = 0;
  virtual void sum(std::span<float> numbers) = 0;
  // to[r] goes to process r; -> what each process has for this one. to: size() messages.
  virtual std::vector<Bytes> exchange(std::vector<Bytes> to) = 0;
  // kFloatingBody when A is not positive definite; kInternal.
  virtual Result<std::unique_ptr<SummedFactor>> factorise(SummedMatrix matrix) = 0;

  // Of this process so far: bytes to others, and the processor time that messages took, waiting for
  // them included. What a factorise() and its solves exchange inside is not counted.
  struct Traffic {
    std::uint64_t bytes_sent = 0;
    double seconds = 0.0;
  };
  virtual Traffic traffic() const = 0;

  // The error of the first process that has one, everywhere.
  Status agree(const Status& own);

  // The part of `count` things, in their order, that falls to process r: from first(r, count) to
  // first(r + 1, count).
  int first(int r, int count) const {
    return static_cast<int>(static_cast<long>(count) * r / size());
  }
};

// The processes that mpirun started. Once in a process, before anything else. In common/mpi,
// for programs that link it.
std::unique_ptr<Ranks> start_ranks(int* argc, char*** argv);

}  // namespace brainshift

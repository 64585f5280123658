// SPDX-License-Identifier: GPL-3.0-or-later
// MpiRanks: the processes of MPI_COMM_WORLD (common/ranks/ranks.hpp). One per process, from
// MPI_Init to MPI_Finalize. Summed matrices are factorised by MUMPS.
//
// A process that ends without the others ends all of them (MPI_Abort in the destructor of an object
// that is destroyed by an exception, MPI's own handler for errors).
#pragma once

#include <memory>

#include "common/ranks/ranks.hpp"

namespace brainshift::mpi {

class MpiRanks final : public Ranks {
 public:
  MpiRanks(int* argc, char*** argv);
  ~MpiRanks() override;
  MpiRanks(const MpiRanks&) = delete;
  MpiRanks& operator=(const MpiRanks&) = delete;

  int rank() const override { return rank_; }
  int size() const override { return size_; }
  void sum(std::span<double> numbers) override;
  void sum(std::span<float> numbers) override;
  std::vector<Bytes> exchange(std::vector<Bytes> to) override;
  Result<std::unique_ptr<SummedFactor>> factorise(SummedMatrix matrix) override;
  Traffic traffic() const override { return traffic_; }

 private:
  template <typename Number>
  void sum_up(std::span<Number> numbers);

  int rank_ = 0, size_ = 1, exceptions_ = 0;
  Traffic traffic_;
};

}  // namespace brainshift::mpi

// SPDX-License-Identifier: GPL-3.0-or-later
// ThreadRanks: threads in the place of processes, dense algebra in that of MUMPS.
#pragma once

#include <barrier>
#include <functional>
#include <mutex>
#include <thread>

#include "common/ranks/ranks.hpp"
#include "tests/support/dense.hpp"

namespace brainshift::test_support {

// What they share.
class ThreadWorld {
 public:
  explicit ThreadWorld(int size) : size_(size), messages_(size), barrier_(size) {}
  int size() const { return size_; }

  std::vector<Ranks::Bytes> exchange(int rank, std::vector<Ranks::Bytes> to) {
    messages_[static_cast<std::size_t>(rank)] = std::move(to);
    barrier_.arrive_and_wait();
    std::vector<Ranks::Bytes> from;
    for (const auto& sent : messages_) from.push_back(sent.at(static_cast<std::size_t>(rank)));
    barrier_.arrive_and_wait();
    return from;
  }

 private:
  int size_;
  std::vector<std::vector<Ranks::Bytes>> messages_;
  std::barrier<> barrier_;
};

class ThreadRanks final : public Ranks {
 public:
  ThreadRanks(ThreadWorld& world, int rank) : world_(world), rank_(rank) {}
  int rank() const override { return rank_; }
  int size() const override { return world_.size(); }
  void sum(std::span<double> numbers) override { sum_up(numbers); }
  void sum(std::span<float> numbers) override { sum_up(numbers); }
  std::vector<Bytes> exchange(std::vector<Bytes> to) override {
    return world_.exchange(rank_, std::move(to));
  }
  Result<std::unique_ptr<SummedFactor>> factorise(SummedMatrix matrix) override {
    Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(matrix.size, matrix.size);
    for (std::size_t i = 0; i < matrix.values.size(); ++i) {
      EXPECT_GE(matrix.rows[i], matrix.columns[i]);
      dense(matrix.rows[i], matrix.columns[i]) += matrix.values[i];
    }
    sum(std::span(dense.data(), static_cast<std::size_t>(dense.size())));
    const Eigen::MatrixXd whole = dense.selfadjointView<Eigen::Lower>();
    return std::make_unique<Dense>(*this, whole);
  }
  Traffic traffic() const override { return {}; }

 private:
  struct Dense final : SummedFactor {
    ThreadRanks& ranks;
    Eigen::MatrixXd matrix;
    Dense(ThreadRanks& of, Eigen::MatrixXd whole) : ranks(of), matrix(std::move(whole)) {}
    Status solve(const Eigen::MatrixXd& b, Eigen::MatrixXd& x) override {
      Eigen::MatrixXd all = b;
      ranks.sum(std::span(all.data(), static_cast<std::size_t>(all.size())));
      x = test_support::solve(matrix, all.transpose()).transpose();
      return {};
    }
    std::size_t bytes() const override { return 0; }
  };
  template <typename Number>
  void sum_up(std::span<Number> numbers) {
    const auto* bytes = reinterpret_cast<const std::byte*>(numbers.data());
    const std::vector<Bytes> from = exchange(std::vector<Bytes>(
        static_cast<std::size_t>(size()), Bytes(bytes, bytes + numbers.size_bytes())));
    std::fill(numbers.begin(), numbers.end(), Number{0});
    for (const Bytes& message : from) {
      const auto* other = reinterpret_cast<const Number*>(message.data());
      for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] += other[i];
    }
  }

  ThreadWorld& world_;
  int rank_;
};

// Calls task(ranks) as each of `size` processes.
inline void run_as_ranks(int size, const std::function<void(Ranks&)>& task) {
  ThreadWorld world(size);
  std::vector<std::thread> threads;
  for (int r = 0; r < size; ++r) {
    threads.emplace_back([&world, &task, r] {
      ThreadRanks ranks(world, r);
      task(ranks);
    });
  }
  for (std::thread& thread : threads) thread.join();
}

}  // namespace brainshift::test_support

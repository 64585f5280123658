// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/mpi/mpi_ranks.hpp"

#define OMPI_SKIP_MPICXX 1
#include <dmumps_c.h>
#include <fmt/format.h>
#include <mpi.h>

#include <algorithm>
#include <ctime>
#include <exception>
#include <type_traits>
#include <utility>

namespace brainshift::mpi {
namespace {

constexpr std::size_t kPiece = std::size_t{1} << 29;  // bytes or numbers of one message: an int

// Adds the processor time of a call to the traffic: MPI asks for messages all the time.
class Timed {
 public:
  explicit Timed(Ranks::Traffic& traffic) : traffic_(traffic) {}
  ~Timed() { traffic_.seconds += now() - begin_; }
  Timed(const Timed&) = delete;
  Timed& operator=(const Timed&) = delete;

 private:
  static double now() {
    timespec time{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  }
  Ranks::Traffic& traffic_;
  double begin_ = now();
};

class MumpsFactor final : public SummedFactor {
 public:
  MumpsFactor(int rank, int size, Ranks::Traffic& traffic)
      : rank_(rank), size_(size), traffic_(traffic) {}
  ~MumpsFactor() override {
    if (started_) call(-2);
  }
  MumpsFactor(const MumpsFactor&) = delete;
  MumpsFactor& operator=(const MumpsFactor&) = delete;

  Status factorise(SummedMatrix matrix) {
    mumps_.sym = 1;
    mumps_.par = 1;
    mumps_.comm_fortran = static_cast<MUMPS_INT>(MPI_Comm_c2f(MPI_COMM_WORLD));
    call(-1);
    started_ = true;
    for (int k = 0; k < 4; ++k) mumps_.icntl[k] = 0;  // no output
    mumps_.icntl[5] = 0;                              // values play no part in the analysis
    mumps_.icntl[6] = 1;                              // given ordering
    mumps_.icntl[7] = 0;                              // no scaling
    mumps_.icntl[13] = 30;                            // percent of memory beyond the estimate
    mumps_.icntl[15] = 1;                             // one thread
    mumps_.icntl[17] = 3;                             // each process has entries of its own
    for (int& row : matrix.rows) ++row;
    for (int& column : matrix.columns) ++column;
    std::vector<int> position(matrix.order.size());
    for (std::size_t k = 0; k < position.size(); ++k) {
      position[static_cast<std::size_t>(matrix.order[k])] = static_cast<int>(k) + 1;
    }
    mumps_.n = matrix.size;
    mumps_.nnz_loc = static_cast<MUMPS_INT8>(matrix.values.size());
    mumps_.irn_loc = matrix.rows.data();
    mumps_.jcn_loc = matrix.columns.data();
    mumps_.a_loc = matrix.values.data();
    mumps_.perm_in = position.data();
    int status = call(1);
    if (status >= 0) status = call(2);
    while ((status == -8 || status == -9) && mumps_.icntl[13] < 1000) {
      mumps_.icntl[13] *= 3;
      status = call(2);
    }
    mumps_.irn_loc = mumps_.jcn_loc = mumps_.perm_in = nullptr;
    mumps_.a_loc = nullptr;
    if (status == -10 || status == -40) {
      return fail(ErrorCode::kFloatingBody,
                  "stiffness matrix: not positive definite between the processes' parts; the body "
                  "is not held (too few fixed nodes) or an element is degenerate");
    }
    if (status >= 0) return {};
    return fail(ErrorCode::kInternal,
                fmt::format("stiffness matrix: MUMPS status {} ({}) for {} unknowns between the "
                            "processes' parts",
                            status, mumps_.infog[1], matrix.size));
  }

  Status solve(const Eigen::MatrixXd& b, Eigen::MatrixXd& x) override {
    columns_ = b.transpose();
    const auto count = static_cast<std::size_t>(columns_.size());
    for (std::size_t at = 0; at < count; at += kPiece) {
      const Timed timed(traffic_);
      const auto piece = static_cast<int>(std::min(kPiece, count - at));
      MPI_Reduce(rank_ == 0 ? MPI_IN_PLACE : columns_.data() + at, columns_.data() + at, piece,
                 MPI_DOUBLE, MPI_SUM, 0, MPI_COMM_WORLD);
    }
    mumps_.rhs = rank_ == 0 ? columns_.data() : nullptr;
    mumps_.nrhs = static_cast<MUMPS_INT>(columns_.cols());
    mumps_.lrhs = mumps_.n;
    mumps_.icntl[26] = std::max(1, mumps_.nrhs);  // right-hand sides at once
    const int status = columns_.cols() > 0 ? call(3) : 0;
    mumps_.rhs = nullptr;
    for (std::size_t at = 0; at < count; at += kPiece) {
      const Timed timed(traffic_);
      MPI_Bcast(columns_.data() + at, static_cast<int>(std::min(kPiece, count - at)), MPI_DOUBLE, 0,
                MPI_COMM_WORLD);
    }
    // To the first process, and back from it.
    traffic_.bytes_sent +=
        count * sizeof(double) * (rank_ == 0 ? static_cast<std::size_t>(size_ - 1) : 1U);
    x = columns_.transpose();
    if (status >= 0) return {};
    return fail(ErrorCode::kInternal, fmt::format("solve: MUMPS status {}", status));
  }

  std::size_t bytes() const override {  // numbers of the factor here, in millions when negative
    const long numbers = mumps_.info[8];
    return sizeof(double) * static_cast<std::size_t>(numbers < 0 ? -numbers * 1000000 : numbers);
  }

 private:
  int call(int job) {
    mumps_.job = job;
    dmumps_c(&mumps_);
    return mumps_.infog[0];
  }

  DMUMPS_STRUC_C mumps_{};
  bool started_ = false;
  int rank_, size_;
  Ranks::Traffic& traffic_;
  Eigen::MatrixXd columns_;
};

}  // namespace

MpiRanks::MpiRanks(int* argc, char*** argv) : exceptions_(std::uncaught_exceptions()) {
  int given = 0;  // one thread calls MPI; others compute
  MPI_Init_thread(argc, argv, MPI_THREAD_FUNNELED, &given);
  MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
  MPI_Comm_size(MPI_COMM_WORLD, &size_);
}

MpiRanks::~MpiRanks() {
  if (std::uncaught_exceptions() > exceptions_) MPI_Abort(MPI_COMM_WORLD, 1);
  MPI_Finalize();
}

// To the first process and from it: a tree of sums may end in other bits elsewhere.
template <typename Number>
void MpiRanks::sum_up(std::span<Number> numbers) {
  const Timed timed(traffic_);
  const MPI_Datatype type = std::is_same_v<Number, float> ? MPI_FLOAT : MPI_DOUBLE;
  for (std::size_t at = 0; at < numbers.size(); at += kPiece) {
    const auto piece = static_cast<int>(std::min(kPiece, numbers.size() - at));
    Number* data = numbers.data() + at;
    MPI_Reduce(rank_ == 0 ? MPI_IN_PLACE : data, data, piece, type, MPI_SUM, 0, MPI_COMM_WORLD);
    MPI_Bcast(data, piece, type, 0, MPI_COMM_WORLD);
  }
  traffic_.bytes_sent +=
      numbers.size_bytes() * (rank_ == 0 ? static_cast<std::size_t>(size_ - 1) : 1U);
}
void MpiRanks::sum(std::span<double> numbers) { sum_up(numbers); }
void MpiRanks::sum(std::span<float> numbers) { sum_up(numbers); }

std::vector<Ranks::Bytes> MpiRanks::exchange(std::vector<Bytes> to) {
  const Timed timed(traffic_);
  const auto count = static_cast<std::size_t>(size_);
  std::vector<long> sent(count), received(count);
  for (std::size_t r = 0; r < count; ++r) sent[r] = static_cast<long>(to[r].size());
  MPI_Alltoall(sent.data(), 1, MPI_LONG, received.data(), 1, MPI_LONG, MPI_COMM_WORLD);
  std::vector<Bytes> from(count);
  std::vector<MPI_Request> requests;
  const auto pieces = [&](Bytes& bytes, const auto& begin) {
    for (std::size_t at = 0; at < bytes.size(); at += kPiece) {
      begin(bytes.data() + at, static_cast<int>(std::min(kPiece, bytes.size() - at)),
            &requests.emplace_back());
    }
  };
  for (int r = 0; r < size_; ++r) {
    const auto at = static_cast<std::size_t>(r);
    if (r == rank_) {
      from[at] = std::move(to[at]);
      continue;
    }
    from[at].resize(static_cast<std::size_t>(received[at]));
    pieces(from[at], [&](std::byte* data, int bytes, MPI_Request* request) {
      MPI_Irecv(data, bytes, MPI_BYTE, r, 0, MPI_COMM_WORLD, request);
    });
    pieces(to[at], [&](std::byte* data, int bytes, MPI_Request* request) {
      MPI_Isend(data, bytes, MPI_BYTE, r, 0, MPI_COMM_WORLD, request);
    });
    traffic_.bytes_sent += to[at].size();
  }
  MPI_Waitall(static_cast<int>(requests.size()), requests.data(), MPI_STATUSES_IGNORE);
  return from;
}

Result<std::unique_ptr<SummedFactor>> MpiRanks::factorise(SummedMatrix matrix) {
  auto factor = std::make_unique<MumpsFactor>(rank_, size_, traffic_);
  if (auto ok = factor->factorise(std::move(matrix)); !ok) return tl::unexpected(ok.error());
  return factor;
}

}  // namespace brainshift::mpi

namespace brainshift {

std::unique_ptr<Ranks> start_ranks(int* argc, char*** argv) {
  return std::make_unique<mpi::MpiRanks>(argc, argv);
}

}  // namespace brainshift

// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/replay/verify.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <string_view>
#include <utility>

#include "common/io/files/file_access.hpp"

namespace brainshift::client {
namespace {

bool same(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

bool same(const MeanStd& a, const MeanStd& b) { return same(a.mean, b.mean) && same(a.std, b.std); }

bool agree(double a, double b, Agreement agreement) {
  if (agreement == Agreement::kBitForBit) return same(a, b);
  const double step = std::numeric_limits<float>::epsilon() * std::max(std::abs(a), std::abs(b));
  return std::abs(a - b) <= kRounding_mm + step;
}

class Comparison {
 public:
  Comparison(const UpdateMessage& recorded, const UpdateMessage& replayed, Agreement agreement)
      : a_(recorded), b_(replayed), agreement_(agreement) {}

  UpdateComparison run() {
    const auto code = [](const std::optional<Error>& error) {
      return error ? std::string(to_string(error->code)) : std::string("none");
    };
    words("error", code(a_.error), code(b_.error));
    if (a_.error || b_.error) return std::move(found_);
    const Estimate& a = a_.update.estimate;
    const Estimate& b = b_.update.estimate;
    words("status", to_string(a.status), to_string(b.status));
    words("quality", to_string(a.quality.quality), to_string(b.quality.quality));
    if (!(a.quality.flags == b.quality.flags)) differs("quality flags");
    found_.displacement_mm = entries("displacement", a.displacement, b.displacement);
    entries("sd_mm", a.sd_mm, b.sd_mm);
    if (a.active_slaves != b.active_slaves) {
      differs(fmt::format("active slaves: {} recorded, {} now, or others", a.contact.active,
                          b.contact.active));
    }
    if (agreement_ == Agreement::kBitForBit) exact(a, b);
    return std::move(found_);
  }

 private:
  void differs(std::string_view what) { found_.differences.emplace_back(what); }

  void words(const char* name, std::string_view recorded, std::string_view replayed) {
    if (recorded != replayed) {
      differs(fmt::format("{}: \"{}\" recorded, \"{}\" now", name, recorded, replayed));
    }
  }

  // Shapes, then entries; the greatest difference is told.
  template <typename Matrix>
  double entries(const char* name, const Matrix& a, const Matrix& b) {
    if (a.rows() != b.rows() || a.cols() != b.cols()) {
      differs(fmt::format("{}: {} numbers recorded, {} now", name, a.size(), b.size()));
      return 0.0;
    }
    double greatest = 0.0;
    Eigen::Index count = 0;
    for (Eigen::Index i = 0; i < a.size(); ++i) {
      const double x = a.data()[i], y = b.data()[i];
      if (!same(x, y)) greatest = std::max(greatest, std::abs(x - y));
      count += agree(x, y, agreement_) ? 0 : 1;
    }
    if (count > 0) differs(fmt::format("{}: {} numbers by up to {:.3g}", name, count, greatest));
    return greatest;
  }

  void exact(const Estimate& a, const Estimate& b) {
    entries("contact forces", a.contact_force_n, b.contact_force_n);
    entries("known", a.known, b.known);
    if (!same(a.region_known, b.region_known)) differs("known of the region");
    if (!same(a.initial_misfit_mm, b.initial_misfit_mm)) differs("initial misfit");
    if (!same(a.misfit_mm, b.misfit_mm)) differs("misfit");
    if (!same(a.contact.max_penetration_mm, b.contact.max_penetration_mm)) differs("penetration");
    if (a.prior_scales != b.prior_scales || a.prior_absent != b.prior_absent) {
      differs("strengths of the prior");
    }
    const auto& A = a_.update.T_undeformed_deformed.matrix();
    if (A != b_.update.T_undeformed_deformed.matrix()) differs("alignment");
    if (!sources_agree(a, b)) differs("sources");
    if (parts_left_out(a_.update) != parts_left_out(b_.update)) differs("what was left out");
  }

  static bool sources_agree(const Estimate& a, const Estimate& b) {
    const auto same_source = [](const SourceSummary& x, const SourceSummary& y) {
      return x.source == y.source && x.observation_sequence == y.observation_sequence &&
             x.data == y.data && x.outliers == y.outliers && same(x.chi_square, y.chi_square);
    };
    return std::equal(a.sources.begin(), a.sources.end(), b.sources.begin(), b.sources.end(),
                      same_source);
  }

  static std::vector<std::string> parts_left_out(const Update& update) {
    std::vector<std::string> parts;
    for (const Omission& omission : update.left_out) {
      if (omission.part != "journal") parts.push_back(omission.part);
    }
    return parts;
  }

  const UpdateMessage& a_;
  const UpdateMessage& b_;
  const Agreement agreement_;
  UpdateComparison found_;
};

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

// Takes the records of a journal one after the other, so that only what waits for its decision or
// its update is in memory.
class Verifier {
 public:
  Verifier(const fs::path& path, const DaemonLink& link, const VerifySession& session)
      : path_(path), link_(link), session_(session) {
    verification_.agreement = session.agreement;
  }

  Status take(const io::SurgeryRecord& record) {
    switch (record.kind) {
      case io::RecordKind::kObservation: return keep(record);
      case io::RecordKind::kDecision: return decide(record);
      case io::RecordKind::kUpdate: return compare(record);
    }
    return {};
  }
  Verification result() { return std::move(verification_); }

 private:
  using Key = std::pair<std::string, std::uint64_t>;  // source, sequence

  tl::unexpected<Error> unreadable(const io::SurgeryRecord& record, const std::string& why) const {
    return io::unreadable(path_,
                          fmt::format("{} {}: {}", to_string(record.kind), record.sequence, why));
  }

  Status keep(const io::SurgeryRecord& record) {
    auto observation = wire::decode_observation(record.payload);
    if (!observation) return unreadable(record, observation.error().message);
    Key key{observation->source, observation->sequence};
    observations_.insert_or_assign(std::move(key), for_replay(std::move(*observation)));
    return {};
  }

  Status decide(const io::SurgeryRecord& record) {
    const auto decision = wire::decode_decision(record.payload);
    if (!decision) return unreadable(record, decision.error().message);
    const auto found = observations_.find({decision->source, decision->observation_sequence});
    if (found == observations_.end()) {
      return unreadable(record, fmt::format("observation {} of {} is not recorded",
                                            decision->observation_sequence, decision->source));
    }
    const Observation observation = std::move(found->second);
    observations_.erase(found);
    const bool used = decision->outcome == Outcome::kUsed;
    if (!used && decision->outcome != Outcome::kFailed) return {};
    auto answer = send(observation);
    if (!answer) return tl::unexpected(answer.error());
    if (used) {
      answers_.insert_or_assign(decision->update_sequence, std::move(*answer));
      return {};
    }
    ++verification_.compared;
    if (!answer->error) {
      differs(decision->update_sequence, observation,
              "failed when recorded (" + decision->reason + "), gives an estimate now");
    }
    return {};
  }

  Status compare(const io::SurgeryRecord& record) {
    const auto recorded = wire::decode_update(record.payload);
    if (!recorded) return unreadable(record, recorded.error().message);
    const auto answer = answers_.find(record.sequence);
    if (answer == answers_.end()) return unreadable(record, "no decision leads to it");
    const UpdateComparison comparison =
        compare_updates(*recorded, answer->second, session_.agreement);
    answers_.erase(answer);
    ++verification_.compared;
    verification_.max_difference_mm =
        std::max(verification_.max_difference_mm, comparison.displacement_mm);
    if (!comparison.differences.empty()) {
      verification_.differences.push_back(fmt::format(
          "update {} (observation {}): {}", record.sequence, recorded->update.observation_sequence,
          fmt::join(comparison.differences, "; ")));
    }
    return {};
  }

  // Sends one observation and waits for what it ends in.
  Result<UpdateMessage> send(const Observation& observation) {
    const std::string name =
        fmt::format("observation {} of {}", observation.sequence, observation.source);
    if (const auto receipt = link_.submit(observation); !receipt) {
      return fail(receipt.error().code, name + ": " + receipt.error().message);
    }
    const auto deadline = Clock::now() + session_.timeout;
    while (true) {
      const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now());
      if (left.count() <= 0) {
        return fail(ErrorCode::kUnavailable,
                    fmt::format("{}: no answer within {} ms", name, session_.timeout.count()));
      }
      auto message = link_.next_update(left);
      if (!message) return fail(message.error().code, name + ": " + message.error().message);
      const bool ours = message->session_id == session_.session_id &&
                        message->update.observation_sequence == observation.sequence;
      if (ours && (message->update.final || message->error)) return message;
    }
  }

  void differs(std::uint64_t sequence, const Observation& observation, const std::string& how) {
    verification_.differences.push_back(
        fmt::format("update {} (observation {}): {}", sequence, observation.sequence, how));
  }

  const fs::path path_;
  const DaemonLink& link_;
  const VerifySession session_;
  std::map<Key, Observation> observations_;         // not decided yet
  std::map<std::uint64_t, UpdateMessage> answers_;  // by the recorded update's sequence
  Verification verification_;
};

Result<SessionRequest> request_of(const io::SurgeryMeta& meta, const fs::path& path) {
  SessionRequest request;
  request.case_id = meta.case_id;
  const auto unknown = [&](const char* key, const std::string& value) {
    return io::unreadable(
        path, fmt::format("meta.{} is \"{}\": it is no journal of a session that could be repeated",
                          key, value));
  };
  const auto method = std::find_if(std::begin(kAllMethods), std::end(kAllMethods),
                                   [&](Method m) { return meta.method == to_string(m); });
  if (method == std::end(kAllMethods)) return unknown("method", meta.method);
  request.method = *method;
  const bool contact = meta.boundary == to_string(Boundary::kContact);
  if (!contact && meta.boundary != to_string(Boundary::kFixed)) {
    return unknown("boundary", meta.boundary);
  }
  request.boundary = contact ? Boundary::kContact : Boundary::kFixed;
  request.recorded_clock = true;
  return request;
}

// Bit for bit only where all three are known and the same.
Agreement agreement_of(const io::SurgeryMeta& meta, const DaemonStatus& status,
                       std::vector<std::string>& notes) {
  Agreement agreement = Agreement::kBitForBit;
  const auto compare = [&](const char* what, const std::string& recorded, const std::string& now) {
    if (!recorded.empty() && recorded == now) return;
    agreement = Agreement::kWithinRounding;
    notes.push_back(fmt::format("{}: \"{}\" recorded, \"{}\" now", what, recorded, now));
  };
  compare("build", meta.build, status.build);
  compare("machine", meta.machine, status.machine);
  compare("BLAS kernel", meta.blas_kernel, status.blas_kernel);
  return agreement;
}

Status check_served(const io::SurgeryMeta& meta, const DaemonStatus& status,
                    const VerifyOptions& options) {
  if (!status.model_ready) {
    return fail(ErrorCode::kModelNotReady, options.endpoint + ": the daemon has no model loaded");
  }
  if (status.case_id == meta.case_id && status.model_id == meta.model_id) return {};
  return io::invalid_file(
      options.journal,
      fmt::format("is of case \"{}\" and model \"{}\", but the daemon at {} serves \"{}\" and "
                  "\"{}\"",
                  meta.case_id, meta.model_id, options.endpoint, status.case_id, status.model_id));
}

}  // namespace

UpdateComparison compare_updates(const UpdateMessage& recorded, const UpdateMessage& replayed,
                                 Agreement agreement) {
  return Comparison(recorded, replayed, agreement).run();
}

std::vector<std::string> report_lines(const Verification& verification) {
  std::vector<std::string> lines = verification.notes;
  const bool exact = verification.agreement == Agreement::kBitForBit;
  lines.push_back(fmt::format(
      "{} of {} answers agree {}; greatest difference {:.3g} mm",
      verification.compared - verification.differences.size(), verification.compared,
      exact ? "bit for bit" : fmt::format("within {:.0e} mm and rounding to 32 bits", kRounding_mm),
      verification.max_difference_mm));
  lines.insert(lines.end(), verification.differences.begin(), verification.differences.end());
  return lines;
}

Result<Verification> verify_records(const io::SurgeryFile& file, const DaemonLink& link,
                                    const VerifySession& session, const Progress& progress) {
  Verifier verifier(file.path(), link, session);
  const auto total = static_cast<double>(std::max<std::uint64_t>(1, file.state().records));
  std::uint64_t taken = 0;
  const Status ok = file.visit([&](const io::SurgeryRecord& record) {
    report(progress, "verify", std::min(1.0, static_cast<double>(taken++) / total));
    return verifier.take(record);
  });
  report(progress, "verify", 1.0);
  if (!ok) return tl::unexpected(ok.error());
  Verification verification = verifier.result();
  if (verification.compared == 0) {
    return io::file_error(ErrorCode::kEmptySet, file.path(), "holds no update to compare with");
  }
  return verification;
}

Result<Verification> verify_journal(const VerifyOptions& options, const Progress& progress) {
  const auto file = io::SurgeryFile::open(options.journal);
  if (!file) return tl::unexpected(file.error());
  const io::SurgeryMeta& meta = file->meta();
  const auto request = request_of(meta, options.journal);
  if (!request) return tl::unexpected(request.error());
  auto client = Client::connect(options.endpoint, {.keys = options.keys});
  if (!client) return tl::unexpected(client.error());
  const auto status = client->status();
  if (!status) return tl::unexpected(status.error());
  if (Status ok = check_served(meta, *status, options); !ok) return tl::unexpected(ok.error());
  std::vector<std::string> notes;
  if (!meta.gap.empty()) notes.push_back("the journal has a gap: " + meta.gap);
  const Agreement agreement = agreement_of(meta, *status, notes);

  auto asked = *request;
  asked.takeover = options.takeover;
  const auto info = client->start_session(asked);
  if (!info) return tl::unexpected(info.error());
  if (Status ok = client->subscribe(Subscription::kMaxWindow); !ok) {
    return tl::unexpected(ok.error());
  }
  auto verification = verify_records(*file, link_to(*client),
                                     {info->session_id, agreement, options.timeout}, progress);
  if (verification) {
    verification->notes.insert(verification->notes.begin(), notes.begin(), notes.end());
  }
  return verification;
}

}  // namespace brainshift::client

// SPDX-License-Identifier: GPL-3.0-or-later
// Verify: a journal replayed as it happened, and every update compared with the recorded one.
//
// The observations that were used, or tried and failed, are sent in the order of the journal's
// decisions, each one after the former was answered; the others are not sent.
//
// Updates must agree bit for bit when the daemon's build, machine type and BLAS kernel are those
// of the journal, else within rounding.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "client/lib/client.hpp"
#include "client/tools/replay/play.hpp"
#include "common/core/error.hpp"
#include "common/core/progress.hpp"
#include "common/io/recording/surgery_file.hpp"
#include "common/wire/convert.hpp"

namespace brainshift::client {

enum class Agreement {
  kBitForBit,      // same build, machine type and BLAS kernel
  kWithinRounding  // anything else: fields within kRounding_mm and one step of a 32-bit float
};
// What other instructions do to the last digits of a field (docs/conventions.md). Fields travel as
// 32-bit floats, which may round to the neighbour.
inline constexpr double kRounding_mm = 1e-9;

struct UpdateComparison {
  std::vector<std::string> differences;  // one clause each; empty: the updates agree
  double displacement_mm = 0.0;          // greatest difference of a node's component
};

// Compares what was estimated and judged: error, status, quality, field, standard deviations,
// contact and, bit for bit, forces, misfits, alignment, strengths, sources and omissions too.
// Numbers, times and the omission of the journal belong to a session and are not compared.
UpdateComparison compare_updates(const UpdateMessage& recorded, const UpdateMessage& replayed,
                                 Agreement agreement);

struct Verification {
  Agreement agreement = Agreement::kBitForBit;
  std::vector<std::string> notes;        // why not bit for bit; gaps of the journal
  std::uint64_t compared = 0;            // answers: updates, and errors of observations that failed
  std::vector<std::string> differences;  // a line for each answer that differs
  double max_difference_mm = 0.0;        // of a node's component, over all updates
};

// Lines for people: what was compared and how, then what differs.
std::vector<std::string> report_lines(const Verification& verification);

struct VerifyOptions {
  std::filesystem::path journal;
  std::string endpoint = "tcp://127.0.0.1:5555";
  std::chrono::milliseconds timeout{600000};      // longest wait for one answer
  bool takeover = false;                          // ends another client's session
  std::optional<ClientKeys> keys = std::nullopt;  // for a daemon that asks for them
};

// Starts a session of the journal's method and boundary. kInvalidArgument: the daemon serves
// another case or model; kUnreadable: the journal is broken, or does not say enough; kEmptySet: it
// holds no answer; kUnavailable: no daemon, or no answer in time. That answers differ is no error
// here.
Result<Verification> verify_journal(const VerifyOptions& options, const Progress& progress = {});

// The same to any daemon; `path` names the file in messages.
struct VerifySession {
  std::uint64_t session_id = 0;
  Agreement agreement = Agreement::kBitForBit;
  std::chrono::milliseconds timeout{600000};
};
Result<Verification> verify_records(const io::SurgeryFile& file, const DaemonLink& link,
                                    const VerifySession& session, const Progress& progress = {});

}  // namespace brainshift::client

// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/export/chosen_update.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "client/tools/journal/journal_export.hpp"
#include "common/io/files/file_access.hpp"

namespace brainshift::client {
namespace {

namespace fs = std::filesystem;

// What stands against an update, in words.
std::string objection(const Update& update) {
  if (!update.final) return "an iterate, not a final estimate";
  const QualityVerdict& verdict = update.estimate.quality;
  if (verdict.quality == Quality::kNotJudged) return "not judged";
  return fmt::format("{} ({}): {}", to_string(verdict.quality), flags_text(verdict),
                     verdict.reason);
}

struct Found {
  std::optional<ChosenUpdate> chosen, last;
  std::uint64_t first_sequence = 0, last_sequence = 0;
  int updates = 0;
};

Result<Found> search(const io::SurgeryFile& file, const fs::path& path,
                     const std::optional<std::uint64_t>& sequence) {
  Found found;
  const Status ok =
      visit_updates(file, path, [&](const UpdateMessage& message, double time_s) -> Status {
        const std::uint64_t number = message.update.sequence;
        found.first_sequence = found.updates == 0 ? number : std::min(found.first_sequence, number);
        found.last_sequence = std::max(found.last_sequence, number);
        ++found.updates;
        const bool wanted =
            sequence ? number == *sequence : !message.error && message.update.usable();
        if (wanted) found.chosen = ChosenUpdate{message, time_s};
        found.last = ChosenUpdate{message, time_s};
        return {};
      });
  if (!ok) return tl::unexpected(ok.error());
  return found;
}

tl::unexpected<Error> none_usable(const fs::path& path, const Found& found) {
  const UpdateMessage& last = found.last->message;
  const std::string why = last.error ? "an error: " + last.error->message : objection(last.update);
  return io::file_error(ErrorCode::kEmptySet, path,
                        fmt::format("holds no usable update; the last of its {}, update {}, is {}",
                                    found.updates, last.update.sequence, why));
}

}  // namespace

Result<ChosenUpdate> choose_update(const io::SurgeryFile& file, const fs::path& path, int nodes,
                                   const UpdateChoice& choice) {
  if (choice.allow_unusable && !choice.sequence) {
    return invalid("--allow-unusable: needs --sequence N, the update that is meant");
  }
  auto found = search(file, path, choice.sequence);
  if (!found) return tl::unexpected(found.error());
  if (found->updates == 0) {
    return io::file_error(ErrorCode::kEmptySet, path,
                          "holds no update: it was simulated or imported. Replay it to a "
                          "brainshiftd that keeps a journal, and export the journal");
  }
  if (!found->chosen && !choice.sequence) return none_usable(path, *found);
  if (!found->chosen) {
    return io::file_error(ErrorCode::kNotFound, path,
                          fmt::format("holds no update {}: has {} to {}", *choice.sequence,
                                      found->first_sequence, found->last_sequence));
  }
  const UpdateMessage& message = found->chosen->message;
  const std::string name = fmt::format("update {}", message.update.sequence);
  if (message.error || message.update.estimate.displacement.cols() == 0) {
    return io::invalid_file(
        path, fmt::format("{} carries no field: {}", name,
                          message.error ? message.error->message : objection(message.update)));
  }
  if (!message.update.usable() && !choice.allow_unusable) {
    return io::invalid_file(path,
                            fmt::format("{} is {}. --allow-unusable exports it all the same, and "
                                        "every file says so",
                                        name, objection(message.update)));
  }
  const auto columns = message.update.estimate.displacement.cols();
  if (columns != nodes) {
    return io::unreadable(
        path, fmt::format("{}: displacement of {} nodes, the model has {}", name, columns, nodes));
  }
  return std::move(*found->chosen);
}

}  // namespace brainshift::client

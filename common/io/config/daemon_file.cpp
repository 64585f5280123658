// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/config/daemon_file.hpp"

#include "common/io/config/key_reader.hpp"
#include "common/io/files/file_access.hpp"

namespace brainshift::io {
namespace {

constexpr Word<const char*> kLogLevels[] = {
    {"trace", "trace"}, {"debug", "debug"}, {"info", "info"}, {"warn", "warn"}, {"error", "error"}};

// The table of the daemon's keys.
template <typename A, Of<DaemonConfig> V>
void visit(A& a, V& v) {
  a({"endpoint", "", "Where clients connect: tcp://HOST:PORT or ipc://PATH", "this machine only",
     "There is no authentication, so open it to a network only where everybody on it is trusted."},
    v.endpoint);
  a({"model", "", "Model file made by `brainshiftd prepare`", "",
     "Clients are told model_not_ready until one is loaded. The command line's --model takes "
     "precedence."},
    v.model);
  a({"journal_dir", "",
     "Folder that keeps a journal of every observation and update, one file per session", "",
     "Without it there is no journal."},
    v.journal_dir);
  a({"log_level", "", "Least severe messages in the log"}, v.log_level, kLogLevels);
  a({"max_clients", "", "Clients served at once", "", "More are refused."}, v.max_clients,
    between(1, 1024));
  a({"max_message_mib", "MiB", "Largest message accepted", "",
     "Larger ones are refused unread. An observation with 100 thousand points takes 2.4 MiB, an "
     "update for 18 thousand nodes "
     "0.6 MiB."},
    v.max_message_mib, between(1, 1024));
}

Status check_endpoint(const std::string& endpoint) {
  const bool ipc = endpoint.rfind("ipc://", 0) == 0 && endpoint.size() > 6;
  const std::size_t colon = endpoint.rfind(':');
  const bool tcp = endpoint.rfind("tcp://", 0) == 0 && colon > 6 && colon + 1 < endpoint.size();
  if (ipc || tcp) return {};
  return fail(ErrorCode::kInvalidArgument,
              "endpoint = " + endpoint + ": must be tcp://HOST:PORT or ipc://PATH");
}

Status validate(const DaemonConfig& config) {
  KeyChecker checker;
  visit(checker, config);
  return checker.status().and_then([&] { return check_endpoint(config.endpoint); });
}

}  // namespace

Result<DaemonConfig> read_daemon_config(const std::filesystem::path& path) {
  const Result<std::string> text = read_file(path);
  if (!text) return tl::unexpected(text.error());
  YamlDocument document = YamlDocument::parse(*text, path);
  YamlSection root = document.root();
  DaemonConfig config;
  KeyReader reader(root);
  visit(reader, config);
  root.done();
  if (Status status = document.status(); !status) return tl::unexpected(status.error());
  if (Status status = validate(config); !status) {
    return tl::unexpected(document.locate(status.error()));
  }
  return config;
}

std::vector<KeyDocument> daemon_key_documents() {
  KeyDocumenter documenter;
  const DaemonConfig defaults;
  visit(documenter, defaults);
  return documenter.documents();
}

}  // namespace brainshift::io

// SPDX-License-Identifier: GPL-3.0-or-later
// What the daemon's configuration file says, and the table of its keys (key_table.hpp).
#pragma once

#include <filesystem>
#include <string>

#include "common/configuration/key_table.hpp"

namespace brainshift::io {

// Where monitors scrape (docs/operations.md).
struct MetricsConfig {
  std::string endpoint;  // HOST:PORT; empty: nowhere
};

// Files of keys (key_file.hpp). Both or none.
struct SecurityConfig {
  std::filesystem::path secret_key;  // the daemon's
  std::filesystem::path allow_list;  // its clients'

  bool on() const { return !secret_key.empty() && !allow_list.empty(); }
};

// Per key of the allow-list; without keys, per connection.
struct LimitsConfig {
  int connections = 8;  // of keys only
  int observations_per_s = 2000;
  int session_starts_per_min = 60;
  int journal_gib = 64;  // of a session, whoever sends
};

// Of the data that a field answers, since they were acquired.
struct AgeConfig {
  double aged_after_s = 30.0;
  double expired_after_s = 120.0;  // not below aged_after_s
};

// What a daemon file says (config/daemon.yaml documents every key).
struct DaemonConfig {
  std::string endpoint = "tcp://127.0.0.1:5555";  // tcp://HOST:PORT or ipc://PATH
  bool allow_remote = false;                      // endpoints that other machines reach
  SecurityConfig security;
  // Model file. Empty: clients get model_not_ready until one is loaded.
  std::filesystem::path model;
  std::filesystem::path journal_dir;  // empty: no journal
  std::string log_level = "info";
  int max_clients = 32;
  int max_message_mib = 16;
  LimitsConfig limits;
  AgeConfig age;
  MetricsConfig metrics;
};

inline constexpr Word<const char*> kLogLevels[] = {
    {"trace", "trace"}, {"debug", "debug"}, {"info", "info"}, {"warn", "warn"}, {"error", "error"}};

inline constexpr Word<bool> kTruthWords[] = {{true, "true"}, {false, "false"}};

template <typename A, Of<DaemonConfig> V>
void visit(A& a, V& v) {
  a({"endpoint", "", "Where clients connect: tcp://HOST:PORT or ipc://PATH", "this machine only",
     "The socket of an ipc endpoint is for the daemon's own account. Other addresses than those of "
     "this machine need allow_remote."},
    v.endpoint);
  a({"allow_remote", "", "Whether the endpoint may be an address that other machines reach", "",
     "It takes the keys of `security` as well."},
    v.allow_remote, kTruthWords);
  a.section({"security"}, Need::kOptional, [&] {
    a({"secret_key", "", "The daemon's secret key, made by `brainshift keys make`", "",
       "A file that its owner alone may read. With both keys everything is encrypted, and only "
       "those in allow_list are served. Without them any peer that can connect has full access."},
      v.security.secret_key);
    a({"allow_list", "",
       "Who is served: a line ROLE NAME PUBLICKEY for each, made by `brainshift keys add`", "",
       "Roles: viewer, source, owner, admin. Read when the daemon starts."},
      v.security.allow_list);
  });
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
    v.max_message_mib, between(1, 64));
  a.section({"limits"}, Need::kOptional, [&] {
    a({"connections", "", "Connections of one key at once", "",
       "More are refused. A program has one, a viewer beside a source two."},
      v.limits.connections, between(1, 1024));
    a({"observations_per_s", "", "Observations of one key in a second", "",
       "The rest is refused and counted. Five sources of 60 Hz have 300; a replay at full speed "
       "has "
       "more."},
      v.limits.observations_per_s, between(1, 10000));
    a({"session_starts_per_min", "", "Sessions that one key may start in a minute", "",
       "The rest is refused and counted."},
      v.limits.session_starts_per_min, between(1, 10000));
    a({"journal_gib", "GiB", "What the journal keeps of one session, whoever sends it", "",
       "Beyond it nothing more of the session is recorded, and every subscriber is told. An hour "
       "of "
       "four updates a second for 18 thousand nodes has 9 GiB."},
      v.limits.journal_gib, between(1, 10000));
  });
  a.section({"age", "", "From when on a field no longer counts as current", "",
             "Its age counts from the acquisition of its data."},
            Need::kOptional, [&] {
              a({"aged_after_s", "s", "An older field is shown as aged", "",
                 "Displays say so, and `brainshift status` ends with 1."},
                v.age.aged_after_s, between(0.1, 1e6));
              a({"expired_after_s", "s", "An older field is not shown any more", "",
                 "Not below aged_after_s."},
                v.age.expired_after_s, between(0.1, 1e6));
            });
  a.section({"metrics", "", "Figures for monitors, over HTTP in the format of Prometheus", "",
             "The path is /metrics; docs/operations.md lists the figures."},
            Need::kOptional, [&] {
              a({"endpoint", "", "Where monitors ask: HOST:PORT", "",
                 "HOST is an address in numbers. Other addresses than those of this machine need "
                 "allow_remote."},
                v.metrics.endpoint);
            });
}

}  // namespace brainshift::io

// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/config/daemon_file.hpp"

#include <gmock/gmock.h>

#include "tests/support/refusals.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/io/config/documented_keys.hpp"

namespace brainshift::io {
namespace {

namespace fs = std::filesystem;
using test_support::content_of;
using test_support::expect_refused;
using test_support::TemporaryFolder;
using testing::AllOf;
using testing::HasSubstr;

TEST(DaemonFile, ShippedFileHasTheDefaults) {
  const auto read =
      value_or_fail(read_daemon_config(fs::path(BRAINSHIFT_SOURCE_DIR) / "config/daemon.yaml"));
  const DaemonConfig defaults;
  EXPECT_EQ(read.endpoint, defaults.endpoint);
  EXPECT_EQ(read.allow_remote, defaults.allow_remote);
  EXPECT_EQ(read.model, defaults.model);
  EXPECT_EQ(read.journal_dir, defaults.journal_dir);
  EXPECT_EQ(read.log_level, defaults.log_level);
  EXPECT_EQ(read.max_clients, defaults.max_clients);
  EXPECT_EQ(read.max_message_mib, defaults.max_message_mib);
  EXPECT_EQ(read.metrics.endpoint, defaults.metrics.endpoint);
  EXPECT_FALSE(read.security.on());
  EXPECT_EQ(read.limits.connections, defaults.limits.connections);
  EXPECT_EQ(read.limits.observations_per_s, defaults.limits.observations_per_s);
  EXPECT_EQ(read.limits.session_starts_per_min, defaults.limits.session_starts_per_min);
  EXPECT_EQ(read.limits.journal_gib, defaults.limits.journal_gib);
}

TEST(DaemonFile, ShippedFileDocumentsEveryKeyAsTheTableDoes) {
  expect_documented(content_of(fs::path(BRAINSHIFT_SOURCE_DIR) / "config/daemon.yaml"),
                    documents_of<DaemonConfig>());
}

class DaemonFileKeys : public testing::Test {
 protected:
  Result<DaemonConfig> read(const std::string& text) {
    return read_daemon_config(folder_.write("d.yaml", text));
  }
  // The same; an error names the file with its folder.
  auto reading() {
    return [this](const std::string& text) {
      auto config = read(text);
      if (!config) {
        EXPECT_THAT(config.error().message, HasSubstr((folder_ / "d.yaml").string()));
      }
      return config;
    };
  }
  TemporaryFolder folder_;
};

TEST_F(DaemonFileKeys, EveryKeyArrivesInItsField) {
  const auto config = value_or_fail(read(
      "endpoint: ipc:///tmp/s\nmodel: m.h5\njournal_dir: /j\nlog_level: debug\nmax_clients: 3\n"
      "max_message_mib: 5\nallow_remote: true\nmetrics: {endpoint: '127.0.0.2:80'}\n"
      "security:\n  secret_key: k\n  allow_list: a\n"
      "limits:\n  connections: 4\n  observations_per_s: 6\n  session_starts_per_min: 7\n  "
      "journal_gib: 8\n"
      "age: {aged_after_s: 8, expired_after_s: 9.5}\n"));
  EXPECT_EQ(config.endpoint, "ipc:///tmp/s");
  EXPECT_TRUE(config.allow_remote);
  EXPECT_EQ(config.model, folder_ / "m.h5");
  EXPECT_EQ(config.journal_dir, "/j");
  EXPECT_EQ(config.log_level, "debug");
  EXPECT_EQ(config.max_clients, 3);
  EXPECT_EQ(config.max_message_mib, 5);
  EXPECT_EQ(config.metrics.endpoint, "127.0.0.2:80");
  EXPECT_EQ(config.security.secret_key, folder_ / "k");
  EXPECT_EQ(config.security.allow_list, folder_ / "a");
  EXPECT_EQ(config.age.aged_after_s, 8.0);
  EXPECT_EQ(config.age.expired_after_s, 9.5);
  EXPECT_EQ(config.limits.connections, 4);
  EXPECT_EQ(config.limits.observations_per_s, 6);
  EXPECT_EQ(config.limits.session_starts_per_min, 7);
  EXPECT_EQ(config.limits.journal_gib, 8);
}

TEST_F(DaemonFileKeys, BadValuesAreRefusedWithFileLineAndKey) {
  expect_refused(
      reading(),
      {{"# a\nport: 5", "d.yaml:2: port: unknown key"},
       {"max_clients: many", "d.yaml:1: max_clients = many: must be an integer"},
       {"max_clients: 0", "d.yaml:1: max_clients = 0: must be between 1 and 1024"},
       {"max_clients: 1025", "d.yaml:1: max_clients = 1025: must be"},
       {"age: {aged_after_s: 0}", "aged_after_s = 0: must be between 0.1 and 1e+06"},
       {"age: {aged_after_s: 8, expired_after_s: 7}",
        "age.expired_after_s = 7: must not be below aged_after_s = 8"},
       {"max_message_mib: 0", "d.yaml:1: max_message_mib = 0: must be between 1 and 64"},
       {"max_message_mib: 65", "d.yaml:1: max_message_mib = 65: must be"},
       {"log_level: loud",
        "d.yaml:1: log_level = loud: must be one of trace, debug, info, warn, error"},
       {"endpoint: 5555", "d.yaml:1: endpoint = 5555: must be tcp://HOST:PORT"},
       {"endpoint: 'tcp://'", "endpoint = tcp://: must be"},
       {"endpoint: 'tcp://host'", "endpoint = tcp://host: must be"},
       {"endpoint: 'tcp://host:'", "endpoint = tcp://host:: must be"},
       {"endpoint: 'ipc://'", "endpoint = ipc://: must be"},
       {"endpoint: 'inproc://x'", "endpoint = inproc://x: must be tcp://HOST:PORT or ipc://PATH"},
       {"endpoint: 'ws://127.0.0.1:80'", "must be tcp://HOST:PORT or ipc://PATH"},
       {"endpoint: 'ipc://@abstract'", "must name the path of a socket"},
       {"endpoint: 'ipc://*'", "must name the path of a socket"},
       {"endpoint: 'tcp://0.0.0.0:5555'",
        "d.yaml:1: endpoint = tcp://0.0.0.0:5555: other machines"},
       {"allow_remote: maybe", "d.yaml:1: allow_remote = maybe: must be one of true, false"},
       {"metrics: {port: 5}", "d.yaml:1: metrics.port: unknown key"},
       {"metrics:\n  endpoint: 0.0.0.0:80",
        "d.yaml:2: metrics.endpoint = 0.0.0.0:80: other machines"},
       {"model: [a]", "d.yaml:1: model = [a]: must be text"}},
      ErrorCode::kInvalidArgument);
}

TEST_F(DaemonFileKeys, WithoutAllowRemoteTheEndpointIsOnThisMachineAlone) {
  for (const char* local : {"tcp://127.0.0.1:5555", "tcp://127.9.9.9:*", "tcp://[::1]:5555",
                            "tcp://localhost:1", "tcp://lo:1", "ipc:///run/brainshift"}) {
    EXPECT_TRUE(check_endpoint(local, false)) << local;
  }
  for (const char* remote :
       {"tcp://0.0.0.0:5555", "tcp://*:5555", "tcp://10.0.0.1:5555", "tcp://[::]:5555",
        "tcp://::1:5555:5555", "tcp://[fe80::1]:5555", "tcp://eth0:5555", "tcp://localhost.org:1",
        "tcp://127.0.0.1.org:1", "tcp://0.0.0.0;127.0.0.1:5555", "tcp://[::ffff:10.0.0.1]:1",
        "tcp://127.1:1", "tcp://2130706433:1"}) {
    EXPECT_THAT(refusal_of(check_endpoint(remote, false), ErrorCode::kInvalidArgument),
                AllOf(HasSubstr(remote), HasSubstr("allow_remote")));
    EXPECT_TRUE(check_endpoint(remote, true)) << remote;
  }
  EXPECT_FALSE(check_endpoint("inproc://x", true));
}

TEST_F(DaemonFileKeys, OffThisMachineADaemonTakesKeysAndAnAllowList) {
  const std::string remote = "endpoint: tcp://0.0.0.0:5555\nallow_remote: true\n";
  const std::string local = "endpoint: tcp://127.0.0.1:5555\n";
  const std::string secret = "security:\n  secret_key: k\n";
  const std::string list = "security:\n  allow_list: a\n";
  const std::string both = secret + "  allow_list: a\n";
  EXPECT_TRUE(read(remote + both));
  EXPECT_TRUE(read(local + both));
  EXPECT_TRUE(read(local));
  expect_refused(reading(),
                 {{remote, "security.secret_key is missing: other machines may reach"},
                  {remote + secret, "security.allow_list is missing"},
                  {remote + list, "security.secret_key is missing"},
                  {local + secret, "security.allow_list is missing"},
                  {local + list, "security.secret_key is missing"}},
                 ErrorCode::kInvalidArgument);
}

TEST_F(DaemonFileKeys, MetricsAreForThisMachineUnlessAllowRemote) {
  for (const char* local : {"127.0.0.1:9464", "[::1]:0", "localhost:65535"}) {
    EXPECT_TRUE(check_metrics_endpoint(local, false)) << local;
  }
  for (const char* remote : {"0.0.0.0:9464", "10.0.0.1:80", "[::]:9464"}) {
    EXPECT_THAT(refusal_of(check_metrics_endpoint(remote, false), ErrorCode::kInvalidArgument),
                AllOf(HasSubstr(remote), HasSubstr("allow_remote")));
    EXPECT_TRUE(check_metrics_endpoint(remote, true)) << remote;
  }
  for (const char* bad :
       {"9464", ":9464", "127.0.0.1", "127.0.0.1:", "127.0.0.1:65536", "127.0.0.1:443s",
        "127.0.0.1:80,0.0.0.0:81", "host:80", "+80", "127.0.0.1:-1", "http://127.0.0.1:80"}) {
    EXPECT_THAT(refusal_of(check_metrics_endpoint(bad, true), ErrorCode::kInvalidArgument),
                HasSubstr("must be HOST:PORT"))
        << bad;
  }
}

TEST_F(DaemonFileKeys, TheImagesFileIsReadAndAMissingOneIsNotFound) {
  const auto config = read_daemon_config(fs::path(BRAINSHIFT_SOURCE_DIR) / "docker/daemon.yaml");
  EXPECT_TRUE(config) << config.error().message;
  refusal_of(read_daemon_config(folder_ / "absent.yaml"), ErrorCode::kNotFound);
}

}  // namespace
}  // namespace brainshift::io

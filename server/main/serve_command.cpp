// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/main/commands.hpp"

#include <fmt/format.h>
#include <malloc.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>
#include <utility>

#include "common/io/config/daemon_file.hpp"
#include "common/io/config/key_file.hpp"
#include "common/io/files/stop_signals.hpp"
#include "common/io/model/model_file.hpp"
#include "common/linalg/openblas.hpp"
#include "server/guard/process_limits.hpp"
#include "server/main/ipc_socket.hpp"
#include "server/main/logging.hpp"
#include "server/main/platform.hpp"
#include "server/operations/metrics.hpp"
#include "server/operations/service_manager.hpp"
#include "server/service/service.hpp"
#include "server/session/model_store.hpp"
#include "server/transport/outbox.hpp"
#include "server/transport/router.hpp"

namespace brainshift::server {
namespace {

// How old the figures of viewers may be that a monitor gets from an idle daemon.
constexpr std::chrono::milliseconds kFreshViewers{1000};
// What a preparation or an update gets to end in once the daemon stops.
constexpr std::chrono::milliseconds kStopGrace{1500};

Result<io::DaemonConfig> configuration(const ServeArguments& arguments) {
  auto config = io::read_daemon_config(arguments.config_file);
  if (!config) return config;
  if (arguments.model) config->model = *arguments.model;
  if (arguments.endpoint) {
    config->endpoint = *arguments.endpoint;
    auto ok = io::check_endpoint(config->endpoint, config->allow_remote).and_then([&] {
      return io::check_security(*config);
    });
    if (!ok) return tl::unexpected(ok.error());
  }
  if (auto ok = check_ipc_path(config->endpoint); !ok) return tl::unexpected(ok.error());
  std::error_code ignored;
  if (!config->journal_dir.empty() &&
      !std::filesystem::is_directory(config->journal_dir, ignored)) {
    return fail(ErrorCode::kNotFound,
                fmt::format("{}: journal_dir: the folder {} does not exist",
                            arguments.config_file.string(), config->journal_dir.string()));
  }
  return config;
}

Result<ServiceOptions> service_options(const io::DaemonConfig& config) {
  ServiceOptions options;
  options.version = BRAINSHIFT_VERSION;
  options.build = program_build(BRAINSHIFT_VERSION);
  options.machine = machine_type();
  options.blas_kernel = linalg::blas_kernel();
  options.journal_dir = config.journal_dir;
  options.journal_bytes = static_cast<std::uint64_t>(config.limits.journal_gib) << 30;
  const auto whole_ms = [](double seconds) {
    return std::chrono::milliseconds(std::llround(1e3 * seconds));
  };
  options.aged_after = whole_ms(config.age.aged_after_s);
  options.expired_after = whole_ms(config.age.expired_after_s);
  if (config.model.empty()) return options;
  // Sessions with a fixed boundary are rare: their operators are read when one starts.
  auto file = io::read_model(config.model, {Boundary::kContact});
  if (!file) return tl::unexpected(file.error());
  const auto notes = io::check_inputs(file->inputs);
  if (!notes) {
    return tl::unexpected(
        Error{notes.error().code, config.model.string() + ": " + notes.error().message});
  }
  for (const std::string& note : *notes) spdlog::info("{}", note);
  auto model = std::make_shared<const BrainModel>(std::move(file->model));
  options.model = model;
  options.case_file = file->config.file;
  auto store =
      std::make_shared<ModelStore>(model, std::move(file->config), std::move(file->condensed),
                                   [path = config.model, model](Boundary boundary) {
                                     return io::read_operators(path, *model, boundary);
                                   });
  // Reading and preparing leave free places in the heap, tens of MiB together.
  ::malloc_trim(0);
  options.make_model = [store](const SessionRequest& request, const std::stop_token& stop) {
    auto made = store->make(request, stop);
    ::malloc_trim(0);
    return made;
  };
  return options;
}

// "tracking, session 3, not recording: disk full"
std::string status_line(const Service& service) {
  const SessionState state = service.session_state();
  std::string line(to_string(state.phase));
  if (state.session.session_id > 0) line += fmt::format(", session {}", state.session.session_id);
  if (!state.reason.empty()) line += ": " + state.reason;
  if (state.recording && !state.recording->recording) {
    line += ", not recording: " + state.recording->reason;
  }
  return line;
}

// Tells the service manager on the transport thread how the daemon is; logs a hang once.
class Reporter {
 public:
  explicit Reporter(ServiceManager& manager) : manager_(manager) {}
  void watch(const Service& service) { service_ = &service; }
  void turn() {
    const auto now = std::chrono::steady_clock::now();
    if (service_ == nullptr || !manager_.due(now)) return;
    const WorkerHealth worker = service_->worker_health();
    const bool well = manager_.turn(status_line(*service_), worker, now);
    if (was_well_ && !well) {
      spdlog::error("the worker hangs: busy for {:.1f} s, at most {:.1f} s", worker.working.count(),
                    worker.limit.count());
    }
    was_well_ = well;
  }

 private:
  ServiceManager& manager_;
  const Service* service_ = nullptr;
  bool was_well_ = true;
};

Result<std::optional<MetricsExporter>> metrics(const io::DaemonConfig& config,
                                               const Service& service) {
  const std::string& endpoint = config.metrics.endpoint;
  if (endpoint.empty()) return std::nullopt;
  auto exporter = MetricsExporter::listen(endpoint, [&service] { return service.report(); });
  if (!exporter) return tl::unexpected(exporter.error());
  spdlog::info("metrics on http://{}:{}/metrics", endpoint.substr(0, endpoint.rfind(':')),
               exporter->port());
  return std::optional<MetricsExporter>(std::move(*exporter));
}

// nullopt without keys.
Result<std::optional<ServerKeys>> server_keys(const io::SecurityConfig& security) {
  if (!security.on()) return std::nullopt;
  auto own = io::read_secret_key(security.secret_key);
  if (!own) return tl::unexpected(own.error());
  const auto allowed = io::read_allow_list(security.allow_list);
  if (!allowed) return tl::unexpected(allowed.error());
  ServerKeys keys;
  // `brainshiftd health` asks with the daemon's own key. No listed name has brackets.
  static constexpr const char* kItself = "(daemon)";
  keys.names.emplace(own->public_key, kItself);
  keys.roles.emplace(kItself, Role::kViewer);
  keys.secret_key = std::move(own->secret_key);
  for (const io::AllowedKey& key : *allowed) {
    keys.names.emplace(key.public_key, key.name);
    keys.roles.emplace(key.name, key.role);
  }
  return keys;
}

Result<RouterOptions> router_options(const io::DaemonConfig& config, long file_limit) {
  auto keys = server_keys(config.security);
  if (!keys) return tl::unexpected(keys.error());
  RouterOptions options;
  options.endpoint = config.endpoint;
  options.max_clients = config.max_clients;
  options.max_message_mib = config.max_message_mib;
  options.max_connections = std::min(connections_within(file_limit),
                                     std::max(options.max_connections, 2 * config.max_clients));
  options.keys = std::move(*keys);
  options.limits = {config.limits.connections, config.limits.observations_per_s,
                    config.limits.session_starts_per_min};
  return options;
}

Status serve(const ServeArguments& arguments) {
  return_large_blocks();
  auto signals = io::StopSignals::catch_all();
  if (!signals) return tl::unexpected(signals.error());
  const auto config = configuration(arguments);
  if (!config) return tl::unexpected(config.error());
  LogOptions log_options;
  log_options.level = config->log_level;
  std::optional<Log> log(std::in_place, log_options);
  auto options = service_options(*config);
  if (!options) return tl::unexpected(options.error());

  const long file_limit = raise_file_limit();
  auto routing = router_options(*config, file_limit);
  if (!routing) return tl::unexpected(routing.error());
  spdlog::info("descriptors {}: at most {} connections", file_limit, routing->max_connections);
  auto manager = ServiceManager::from_environment();
  Reporter reporter(manager);
  if (const auto interval = manager.interval()) routing->longest_wait = *interval;
  if (!config->metrics.endpoint.empty() && !manager.interval()) {
    routing->longest_wait = kFreshViewers;
  }
  auto router = [&] {
    const OwnerOnly ipc_socket;  // no thread of ours creates files yet
    return Router::bind(*routing);
  }();
  if (!router) return tl::unexpected(router.error());

  if (options->model) {
    spdlog::info("model loaded case={} model={} nodes={}", options->model->case_id,
                 options->model->model_id, options->model->mesh.num_nodes());
  } else {
    spdlog::warn("no model is loaded: clients get model_not_ready");
  }
  if (!options->blas_kernel.empty()) spdlog::info("OpenBLAS kernel {}", options->blas_kernel);
  if (routing->keys) {
    spdlog::info("authentication is on: {} keys are known", routing->keys->names.size());
  } else {
    spdlog::info("authentication is off: any peer that can connect has full access");
  }
  Outbox outbox;
  options->log_lines_lost = [&log] { return log->lost(); };
  options->on_turn = [&reporter] { reporter.turn(); };
  Service service(std::move(*options), outbox);
  reporter.watch(service);
  auto exporter = metrics(*config, service);
  if (!exporter) return tl::unexpected(exporter.error());
  fmt::print("listening on {}\n", router->endpoint());
  std::fflush(stdout);
  manager.ready();
  auto status = router->run(service, outbox, signals->fd());
  spdlog::info("stopping");
  manager.stopping();
  exporter->reset();
  if (service.stop(kStopGrace)) return status;
  // A library that heeds no stop is at work: a factorisation, or OpenBLAS without address space.
  spdlog::warn("ended while a preparation or an update was still at work; the journal is closed");
  { const Router ended = std::move(*router); }  // removes the socket of an ipc path
  log.reset();
  std::_Exit(status ? kExitSuccess : print_error(status.error()));
}

}  // namespace

int run_serve(const ServeArguments& arguments) {
  const auto status = serve(arguments);
  return status ? kExitSuccess : print_error(status.error());
}

}  // namespace brainshift::server

// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/main/serve_command.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <utility>

#include "common/io/config/daemon_file.hpp"
#include "common/io/config/key_file.hpp"
#include "common/io/model/model_file.hpp"
#include "common/linalg/blas_kernel.hpp"
#include "server/guard/file_limit.hpp"
#include "server/guard/memory.hpp"
#include "server/main/exit_status.hpp"
#include "server/main/ipc_socket.hpp"
#include "server/main/logging.hpp"
#include "server/main/platform.hpp"
#include "server/main/stop_signals.hpp"
#include "server/service/service.hpp"
#include "server/session/model_store.hpp"
#include "server/transport/outbox.hpp"
#include "server/transport/router.hpp"

namespace brainshift::server {
namespace {

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
  if (config.model.empty()) return options;
  auto file = io::read_model(config.model);
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
      std::make_shared<ModelStore>(model, std::move(file->config), std::move(file->condensed));
  options.make_model = [store](const wire::SessionRequest& request, const std::stop_token& stop) {
    return store->make(request, stop);
  };
  return options;
}

// nullopt without keys.
Result<std::optional<ServerKeys>> server_keys(const io::SecurityConfig& security) {
  if (!security.on()) return std::nullopt;
  auto own = io::read_secret_key(security.secret_key);
  if (!own) return tl::unexpected(own.error());
  const auto allowed = io::read_allow_list(security.allow_list);
  if (!allowed) return tl::unexpected(allowed.error());
  ServerKeys keys;
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
  auto signals = StopSignals::catch_all();
  if (!signals) return tl::unexpected(signals.error());
  const auto config = configuration(arguments);
  if (!config) return tl::unexpected(config.error());
  LogOptions log_options;
  log_options.level = config->log_level;
  const Log log(log_options);
  auto options = service_options(*config);
  if (!options) return tl::unexpected(options.error());

  const long file_limit = raise_file_limit();
  const auto routing = router_options(*config, file_limit);
  if (!routing) return tl::unexpected(routing.error());
  spdlog::info("descriptors {}: at most {} connections", file_limit, routing->max_connections);
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
    spdlog::info("keys are asked for; {} are known", routing->keys->names.size());
  } else {
    spdlog::info("no keys are asked for: everybody who reaches the endpoint may do everything");
  }
  Outbox outbox;
  Service service(std::move(*options), outbox);
  fmt::print("listening on {}\n", router->endpoint());
  std::fflush(stdout);
  auto status = router->run(service, outbox, signals->fd());
  spdlog::info("stopping");
  service.stop();
  return status;
}

}  // namespace

int run_serve(const ServeArguments& arguments) {
  const auto status = serve(arguments);
  return status ? kExitSuccess : print_error(status.error());
}

}  // namespace brainshift::server

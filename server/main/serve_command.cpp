// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/main/serve_command.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <cstdio>
#include <memory>
#include <utility>

#include "common/io/config/daemon_file.hpp"
#include "common/io/model/model_file.hpp"
#include "common/linalg/blas_kernel.hpp"
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
    if (auto ok = io::check_endpoint(config->endpoint, config->allow_remote); !ok) {
      return tl::unexpected(ok.error());
    }
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

Status serve(const ServeArguments& arguments) {
  auto signals = StopSignals::catch_all();
  if (!signals) return tl::unexpected(signals.error());
  const auto config = configuration(arguments);
  if (!config) return tl::unexpected(config.error());
  LogOptions log_options;
  log_options.level = config->log_level;
  const Log log(log_options);
  auto options = service_options(*config);
  if (!options) return tl::unexpected(options.error());

  RouterOptions router_options;
  router_options.endpoint = config->endpoint;
  router_options.max_clients = config->max_clients;
  router_options.max_message_mib = config->max_message_mib;
  auto router = [&] {
    const OwnerOnly ipc_socket;  // no thread of ours creates files yet
    return Router::bind(router_options);
  }();
  if (!router) return tl::unexpected(router.error());

  if (options->model) {
    spdlog::info("model loaded case={} model={} nodes={}", options->model->case_id,
                 options->model->model_id, options->model->mesh.num_nodes());
  } else {
    spdlog::warn("no model is loaded: clients get model_not_ready");
  }
  if (!options->blas_kernel.empty()) spdlog::info("OpenBLAS kernel {}", options->blas_kernel);
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

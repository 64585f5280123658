// SPDX-License-Identifier: GPL-3.0-or-later
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>
#include <memory>

#include "client/tools/bridge/bridge.hpp"
#include "client/tools/bridge/line_queue.hpp"
#include "client/tools/cli/command.hpp"
#include "client/tools/monitor/watch.hpp"
#include "common/io/files/stop_signals.hpp"

namespace brainshift::client {
namespace {

struct BridgeArguments {
  BridgeOptions options;
  std::string listen = "127.0.0.1:18945";
  std::string from;
  std::string region = "tumour:40mm";
  std::string margin = "10mm";
  std::string spacing = "2mm";
  bool without_sd = false;
  bool without_surfaces = false;
  KeyOptions keys;
};

Result<BridgeOptions> read_options(const BridgeArguments& arguments) {
  BridgeOptions options = arguments.options;
  auto listen = parse_address("--listen", arguments.listen);
  if (!listen) return tl::unexpected(listen.error());
  options.listen = *listen;
  if (!arguments.from.empty()) {
    auto from = parse_address("--from", arguments.from);
    if (!from) return tl::unexpected(from.error());
    options.from = *from;
  }
  const auto choice = parse_choice({.region = arguments.region});
  if (!choice) return tl::unexpected(choice.error());
  options.stream.region = choice->region;
  const auto margin_mm = parse_length("--margin", arguments.margin);
  if (!margin_mm) return tl::unexpected(margin_mm.error());
  options.stream.margin_mm = *margin_mm;
  const auto spacing_mm = parse_length("--spacing", arguments.spacing);
  if (!spacing_mm) return tl::unexpected(spacing_mm.error());
  options.stream.spacing_mm = *spacing_mm;
  options.stream.with_sd = !arguments.without_sd;
  options.stream.with_surfaces = !arguments.without_surfaces;
  if (Status ok = read_keys(arguments.keys, options.keys); !ok) return tl::unexpected(ok.error());
  return options;
}

Status run_bridge(const BridgeArguments& arguments) {
  const auto options = read_options(arguments);
  if (!options) return tl::unexpected(options.error());
  // A reader that stops must not stop the bridge, nor end it without a blank picture.
  std::signal(SIGPIPE, SIG_IGN);
  LineQueue lines(STDOUT_FILENO);
  const auto bridge =
      Bridge::open(*options, [&lines](const std::string& line) { lines.tell(line); });
  if (!bridge) return tl::unexpected(bridge.error());
  const Address address = (*bridge)->address();
  lines.tell("listening on " + to_string(address));
  if (!is_loopback(address)) {
    std::fprintf(stderr,
                 "brainshift: OpenIGTLink has no encryption and no passwords: whoever reaches %s "
                 "reads the patient's field, and may send models\n",
                 to_string(address).c_str());
  }
  const auto signals = io::StopSignals::catch_into((*bridge)->stop_fd());
  if (!signals) return tl::unexpected(signals.error());
  return (*bridge)->run();
}

void add_stream_options(CLI::App& command, BridgeArguments& arguments) {
  add_with_default(command, "--endpoint", arguments.options.endpoint, "where the daemon listens");
  add_key_options(command, arguments.keys);
  add_with_default(command, "--listen", arguments.listen,
                   "where OpenIGTLink clients connect; another address than this computer's own "
                   "opens the patient's data to the network");
  add_with_default(command, "--region", arguments.region,
                   "what the volumes hold: brain, tumour:MARGIN, or a ball X,Y,Z:RADIUS (patient "
                   "RAS, mm, undeformed)");
  add_with_default(command, "--margin", arguments.margin,
                   "how far the volumes reach beyond the region; there the field fades to zero");
  add_with_default(command, "--spacing", arguments.spacing, "between voxels");
  command.add_flag("--no-sd", arguments.without_sd,
                   "send neither standard deviations nor what is known");
  command.add_flag("--no-surfaces", arguments.without_surfaces,
                   "send neither tumour nor cortex; receive the region alone from the daemon");
  command.add_flag("--json", arguments.options.json, "a line is a JSON object");
}

void add_inbound_options(CLI::App& command, BridgeArguments& arguments) {
  InboxOptions& inbox = arguments.options.inbox;
  const char* group = "What comes in";
  const auto file = [&](const char* name, auto& target, const char* help) {
    command.add_option(name, target, help)->group(group);
  };
  const auto number = [&](const char* name, double& target, const char* help) {
    add_with_default(command, name, target, help)->group(group);
  };
  file("--from", arguments.from, "PlusServer or 3D Slicer to connect to, as HOST:PORT");
  file("--tumour-device", inbox.tumour_device,
       "model or points of this name are the tumour's boundary now");
  file("--surface-device", inbox.surface_device,
       "model or points of this name are the exposed cortex now");
  file("--landmarks-before", inbox.landmarks_before,
       "points of this name: places before surgery (RAS)");
  file("--landmarks-after", inbox.landmarks_after,
       "points of this name: where the same-named places are now");
  add_with_default(command, "--model-frame", inbox.model_frame,
                   "frame of models and points; transforms lead from there to Ras")
      ->group(group);
  file("--contours", inbox.contours,
       "traced tumour contours of a sweep's images: .csv time_s,u_px,v_px or .json, time_s as in "
       "the image's message; read when the sweep ends");
  file("--seeds", inbox.seeds,
       "instead of contours: a point inside the tumour, .csv time_s,u_px,v_px");
  file("--device", inbox.device, "PLUS device set (.xml) with ImageToProbe");
  file("--registration", inbox.registration,
       "T_ras_reference: 16 numbers row by row (text, JSON or YAML)");
  command.add_flag("--open-contours", inbox.open_contours, "contours of a .csv are open lines")
      ->group(group);
  file("--image-device", inbox.image_device, "take images of this device name alone");
  add_with_default(command, "--image", inbox.image_frame, "name of the images' frame")
      ->group(group);
  add_with_default(command, "--reference", inbox.reference_frame,
                   "name of the patient's reference frame")
      ->group(group);
  number("--sweeps", inbox.sweep_gap_s, "a sweep ends after so many seconds without an image");
  number("--sd-mm", inbox.sd_mm, "standard deviation of a tumour boundary point, mm");
  number("--surface-sd-mm", inbox.surface_sd_mm, "standard deviation of a surface point, mm");
  number("--landmark-sd-mm", inbox.landmark_sd_mm, "standard deviation of a landmark pair, mm");
  number("--latency-ms", inbox.latency_ms, "how much later images are stamped than seen, ms");
  number("--max-data-age-s", inbox.max_data_age_s,
         "refuse what is older than this by the time in its message and this computer's clock, s");
  number("--max-pose-age-s", inbox.max_pose_age_s,
         "models follow poses that were seen within this of them, s");
  command
      .add_flag("--relative-times", inbox.relative_times,
                "the times of messages are not of today, as of a recording that is played")
      ->group(group);
  command
      .add_option("--case", arguments.options.case_id,
                  "what comes in is of this case alone; default: of the first that the daemon "
                  "serves")
      ->group(group);
  number("--max-age-ms", inbox.max_age_ms, "poses are not interpolated across a longer gap, ms");
}

}  // namespace

void add_bridge(CLI::App& app, Status& status) {
  auto arguments = std::make_shared<BridgeArguments>();
  CLI::App* command = app.add_subcommand(
      "bridge",
      "Show a running daemon's field in 3D Slicer and other OpenIGTLink programs, and take images, "
      "models and points from them (docs/bridge.md).");
  add_stream_options(*command, *arguments);
  add_inbound_options(*command, *arguments);
  command->footer(
      R"(It starts no session. Clients get, on the undeformed brain in RAS and mm: brainshift_u (the
displacement, undeformed to deformed), brainshift_sd, brainshift_known (0 a guess, 1 known by the
data), brainshift_tumour, brainshift_cortex, of a model with anatomy brainshift_ventricles and
brainshift_septa (falx and tentorium), brainshift_state (JSON) and brainshift (STATUS). When the
field is not current, the volumes are blank and the reason is given. Examples:
  brainshift bridge
      then, in Slicer's OpenIGTLinkIF: a client connector to localhost, port 18945
  brainshift bridge --region brain --margin 20mm --spacing 3mm --no-surfaces
  brainshift bridge --tumour-device TumourNow
      a model that Slicer sends on the same connection is the tumour's boundary
  brainshift bridge --from 127.0.0.1:18944 --seeds seeds.csv --device device.xml \
    --registration T_ras_reference.txt
      sweeps of PlusServer; each becomes an observation two seconds after its last image)");
  command->callback([arguments, &status] { status = run_bridge(*arguments); });
}

}  // namespace brainshift::client

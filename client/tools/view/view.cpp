// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/view/view.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <deque>
#include <map>
#include <thread>
#include <utility>

#include "client/lib/client.hpp"
#include "client/tools/view/http_server.hpp"
#include "client/tools/view/page_advice.hpp"
#include "client/tools/view/site.hpp"
#include "client/tools/view/volumes.hpp"
#include "common/core/stopwatch.hpp"
#include "common/geometry/tumour_motion.hpp"
#include "common/io/geometry/image_file.hpp"
#include "common/io/model/model_file.hpp"

namespace brainshift::client {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kLook{50};
constexpr milliseconds kSignOfLife{150};  // the page's patience is 700 ms
constexpr milliseconds kModelTimeout{5000};
constexpr milliseconds kReportTimeout{250};  // a frozen daemon must not keep the page waiting
constexpr double kNoNews_ms = 90.0;
constexpr double kReportEvery_s = 1.0;
constexpr double kRatesOver_s = 10.0;
constexpr double kOverdue_s = 1.0;  // a newer field that was announced
constexpr std::size_t kMostPoints = 300;

// The model file's MRI, for the daemon that serves this model.
struct GivenHead {
  std::string path, model_id;
  std::optional<VoxelImage> mri;
};

Result<GivenHead> read_head(const std::filesystem::path& path) {
  auto file = io::read_model(path, {});
  if (!file) return tl::unexpected(file.error());
  GivenHead head{path.string(), file->model.model_id, std::nullopt};
  const std::filesystem::path& mri = file->config.mri;
  if (mri.empty()) return invalid(path.string() + ": its case names no MRI: leave --model out");
  std::erase_if(file->inputs, [&](const io::InputFile& input) { return input.path != mri; });
  if (const auto same = io::check_inputs(file->inputs); !same) {
    return tl::unexpected(same.error());
  }
  auto image = io::read_nifti(mri);
  if (!image) return tl::unexpected(image.error());
  head.mri = std::move(*image);
  return head;
}

std::string name_of(std::uint64_t boot, std::uint64_t session) {
  return std::to_string(boot) + "." + std::to_string(session);
}

class Viewer {
 public:
  Viewer(const ViewOptions& options, std::optional<GivenHead> head, Site& site,
         const std::function<void(const std::string&)>& tell)
      : options_(options), head_(std::move(head)), site_(site), tell_(tell) {
    state_.endpoint = options.endpoint;
    if (options.journal.empty()) return;
    state_.advises = true;
    advice_.emplace(options.model, options.journal,
                    [&site](std::string json) { site.show_advice(std::move(json)); });
    site.on_advice_asked([this] { advice_->ask(); });
  }

  Status run(const std::function<bool()>& stopped) {
    while (!stopped()) {
      const Status status = follow(stopped);
      if (stopped()) break;
      if (status) continue;
      const ErrorCode code = status.error().code;
      const bool may_pass = code == ErrorCode::kUnavailable || code == ErrorCode::kModelNotReady;
      if (!began_ && !may_pass) return status;
      const std::string& why = status.error().message;
      if (std::exchange(told_, why) != why) tell_(why);
      for (int i = 0; i < 3 && !stopped(); ++i) {
        publish({Currency::kStale, why, kNoNumber, state_.status.recorded});
        std::this_thread::sleep_for(kSignOfLife);
      }
    }
    return {};
  }

 private:
  // From a connection to its end, or to another model; an error says why there is none.
  Status follow(const std::function<bool()>& stopped) {
    auto client = Client::connect(options_.endpoint,
                                  {.request_timeout = kModelTimeout, .keys = options_.keys});
    if (!client) return tl::unexpected(client.error());
    auto reporter = Client::connect(options_.endpoint,
                                    {.request_timeout = kReportTimeout, .keys = options_.keys});
    if (!reporter) return tl::unexpected(reporter.error());
    // Asked first, and soon told: there is a daemon from which a model may be fetched.
    if (const auto there = reporter->status(); !there) return tl::unexpected(there.error());
    if (Status ok = load_model(*client); !ok) return ok;
    if (Status ok = client->subscribe(); !ok) return ok;
    told_.clear();
    while (!stopped()) {
      if (Status ok = look(*client, *reporter); !ok) return ok;
      const auto& said = client->session_state();
      const bool other =
          said && !said->session.model_id.empty() && said->session.model_id != state_.model_id;
      if (other) {
        publish(client->field_status());
        return {};
      }
    }
    return {};
  }

  Status load_model(Client& client) {
    const auto model = client.model();
    if (!model) return tl::unexpected(model.error());
    if (head_ && head_->model_id != model->model_id) {
      state_.model_id.clear();
      return invalid(fmt::format("{} serves model {} of case {}, {} is model {}", options_.endpoint,
                                 model->model_id, model->case_id, head_->path, head_->model_id));
    }
    if (model->model_id == state_.model_id) return {};
    auto volume = FieldVolume::build(*model);
    if (!volume) return tl::unexpected(volume.error());
    std::optional<GreyVolume> grey;
    if (head_) {
      auto made = grey_volume(*head_->mri, model->mesh.nodes);
      if (!made) return tl::unexpected(made.error());
      grey = std::move(*made);
    }
    tumour_ = geometry::tumour_nodes(*model);
    site_.show_model(
        model->model_id,
        to_json(*model, volume->grid(), grey ? std::optional(grey->grid) : std::nullopt),
        volume->inside(), grey ? std::optional(std::move(grey->voxels)) : std::nullopt);
    volume_ = std::move(*volume);
    forget_session("");
    state_.model_id = model->model_id;
    state_.case_id = model->case_id;
    began_ = true;
    tell_("case " + model->case_id + ", model " + model->model_id);
    return {};
  }

  void forget_session(const std::string& next) {
    state_.session = next;
    state_.field.clear();
    state_.quality = "none";
    state_.quality_reason.clear();
    state_.newest_failure.clear();
    state_.shown.reset();
    state_.left_out.clear();
    points_.clear();
    used_.clear();
    ++state_.history;
    site_.show_history(next, to_json(points_));
    if (advice_) advice_->show_nothing();
  }

  Status look(Client& client, Client& reporter) {
    const Stopwatch watch;
    const auto message = client.next_update(kLook);
    if (message) {
      note(*message);
    } else if (message.error().code != ErrorCode::kUnavailable &&
               message.error().code != ErrorCode::kProtocol) {
      return tl::unexpected(message.error());
    } else if (watch.milliseconds() < 5.0) {
      std::this_thread::sleep_for(kLook);  // a lost connection is told at once
    }
    FieldStatus status = client.field_status();
    follow_session(client);
    if (const auto& usable = client.latest_usable()) show(*usable);
    judge_overdue(status);
    const bool heard = status.currency != Currency::kStale;
    if (heard && since_report_.seconds() > kReportEvery_s) {
      since_report_ = {};
      if (const auto report = reporter.report()) count(*report);
      status = client.field_status();
    }
    publish(status);
    return {};
  }

  // A newer field that is announced comes within milliseconds. When it does not, the one that
  // stands is not current any more.
  void judge_overdue(FieldStatus& status) {
    if (status.currency != Currency::kSuperseded) {
      superseded_.reset();
      return;
    }
    if (!superseded_) superseded_.emplace();
    if (superseded_->seconds() < kOverdue_s) return;
    status.currency = Currency::kStale;
    status.reason = "a newer field was announced and has not come";
  }

  void follow_session(const Client& client) {
    const auto& said = client.session_state();
    if (!said) return;
    const SessionKey& key = said->session;
    const std::string session = key.session_id == 0 ? "" : name_of(key.boot_id, key.session_id);
    if (session != state_.session) forget_session(session);
    state_.method = said->method;
    state_.boundary = said->boundary;
  }

  void note(const UpdateMessage& message) {
    if (!message.update.final || message.update.model_id != state_.model_id) return;
    const std::string session = name_of(message.boot_id, message.session_id);
    if (session != state_.session) forget_session(session);
    points_.push_back(history_point(message, tumour_));
    if (points_.size() > kMostPoints) points_.pop_front();
    ++state_.history;
    site_.show_history(session, to_json(points_));
    state_.newest_failure.clear();
    if (message.error) state_.newest_failure = message.error->message;
    if (!message.error && !message.update.usable()) {
      state_.newest_failure = message.update.estimate.quality.reason;
    }
  }

  void show(const UpdateMessage& message) {
    const Update& update = message.update;
    const std::string of =
        name_of(message.boot_id, message.session_id) + "." + std::to_string(update.sequence);
    const auto nodes = static_cast<Eigen::Index>(update.estimate.displacement.cols());
    if (of == state_.field || update.model_id != state_.model_id || update.part) return;
    auto encoded =
        volume_->encode(update.estimate.displacement, update.estimate.sd_mm,
                        update.estimate.known.size() == nodes ? update.estimate.known : VecX());
    site_.show_field(of, std::move(encoded.bytes));
    state_.grid_error_mm = encoded.grid_error_mm;
    state_.field = of;
    state_.quality = to_string(update.estimate.quality.quality);
    state_.quality_reason = update.estimate.quality.reason;
    state_.shown = history_point(message, tumour_);
    state_.left_out = update.left_out;
    used_ = update.estimate.sources;
    if (advice_) ask_for_advice(message);
  }

  void ask_for_advice(const UpdateMessage& message) {
    ShownField shown{state_.field,
                     {message.boot_id, message.session_id, state_.model_id},
                     message.update.boundary,
                     {}};
    for (const SourceSummary& source : used_)
      shown.used.emplace(source.source, source.observation_sequence);
    advice_->show(std::move(shown));
  }

  void count(const wire::DaemonReport& report) {
    const double now_s = clock_ms() / 1e3;
    state_.sources.clear();
    for (const wire::SourceCounts& counts : report.sources) {
      auto& past = received_[counts.source];
      if (!past.empty() && counts.received < past.back().second) past.clear();  // another daemon
      past.emplace_back(now_s, counts.received);
      while (past.size() > 2 && now_s - past.front().first > kRatesOver_s) past.pop_front();
      SourceLine line;
      line.name = counts.source.empty() ? "not known" : counts.source;
      const double span_s = now_s - past.front().first;
      if (span_s > 0.0) {
        line.per_s = static_cast<double>(counts.received - past.front().second) / span_s;
      }
      line.age_s = 1e-3 * counts.age_ms;
      line.dropped = counts.replaced + counts.skipped + counts.refused;
      for (const SourceSummary& used : used_) {
        if (used.source != counts.source) continue;
        line.data = used.data;
        line.outliers = used.outliers;
        line.contradicts = !used.consistent;
      }
      state_.sources.push_back(std::move(line));
    }
  }

  static double clock_ms() {
    return std::chrono::duration<double, std::milli>(BootClock::now().time_since_epoch()).count();
  }

  // At once when something has changed, else as a sign of life.
  void publish(const FieldStatus& status) {
    std::string news =
        fmt::format("{} {} {} {} {} {}", state_.session, state_.field, state_.history,
                    state_.model_id, to_string(status.currency), status.reason);
    if (news == news_ && since_published_.milliseconds() < kNoNews_ms) return;
    news_ = std::move(news);
    since_published_ = {};
    state_.status = status;
    site_.publish(to_json(state_, clock_ms()));
  }

  const ViewOptions& options_;
  const std::optional<GivenHead> head_;
  Site& site_;
  const std::function<void(const std::string&)>& tell_;
  PageState state_;
  std::optional<FieldVolume> volume_;
  std::vector<NodeIndex> tumour_;
  bool began_ = false;  // a model was loaded once
  std::string told_;    // why there is no connection, when it was told
  std::deque<HistoryPoint> points_;
  std::vector<SourceSummary> used_;  // of the shown update
  // When (s) how many observations of a source had arrived.
  std::map<std::string, std::deque<std::pair<double, std::uint64_t>>> received_;
  std::string news_;  // of the newest event
  Stopwatch since_published_;
  Stopwatch since_report_;
  std::optional<Stopwatch> superseded_;
  std::optional<PageAdvice> advice_;  // with a journal
};

}  // namespace

Status view(const ViewOptions& options, const std::function<bool()>& stopped,
            const std::function<void(const std::string&)>& tell) {
  if (!options.journal.empty()) {
    if (options.model.empty()) return invalid("--journal needs --model");
    if (std::error_code none; !std::filesystem::is_directory(options.journal, none)) {
      return fail(ErrorCode::kNotFound, "--journal: " + options.journal.string() + " is no folder");
    }
  }
  std::optional<GivenHead> head;
  if (!options.model.empty()) {
    auto read = read_head(options.model);
    if (!read) return tl::unexpected(read.error());
    head = std::move(*read);
  }
  Site site;
  Viewer viewer(options, std::move(head), site, tell);  // before the server, which asks it
  const auto server = HttpServer::listen(options.listen, site.source());
  if (!server) return tl::unexpected(server.error());
  Address address = options.listen;
  address.port = static_cast<std::uint16_t>(server->port());
  tell("http://" + to_string(address) + "/   (Ctrl-C ends it)");
  return viewer.run(stopped);
}

}  // namespace brainshift::client

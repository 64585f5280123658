// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/report/write_report.hpp"

#include <map>

#include "client/tools/pictures/canvas.hpp"
#include "client/tools/report/figures.hpp"
#include "client/tools/report/head.hpp"
#include "client/tools/report/html_page.hpp"
#include "common/io/files/file_access.hpp"

namespace brainshift::client {
namespace {

namespace fs = std::filesystem;

// Reads every report with the fields it names, which lie beside it. In the result the names of
// field files are relative to `out`, where the merged report will lie.
Result<std::vector<ReportedRun>> load_runs(const ReportOptions& options) {
  std::vector<ReportedRun> runs;
  for (const fs::path& path : options.reports) {
    auto reports = read_reports(path);
    if (!reports) return tl::unexpected(reports.error());
    for (RunReport& report : *reports) {
      ReportedRun run{std::move(report), std::nullopt};
      if (!run.report.field_file.empty()) {
        const fs::path file = path.parent_path() / run.report.field_file;
        auto field = load_field(file);
        if (!field) return tl::unexpected(field.error());
        run.field = std::move(*field);
        run.report.field_file =
            fs::absolute(file).lexically_proximate(fs::absolute(options.out)).string();
      }
      runs.push_back(std::move(run));
    }
  }
  if (runs.empty()) {
    return fail(ErrorCode::kEmptySet, options.reports.empty()
                                          ? std::string("no report given")
                                          : options.reports.front().string() + ": holds no run");
  }
  return runs;
}

// One Head per case file of the runs that have a field to draw.
Result<std::map<std::string, Head>> load_heads(const std::vector<ReportedRun>& runs,
                                               const Progress& progress) {
  std::map<std::string, Head> heads;
  for (const ReportedRun& run : runs) {
    const std::string& file = run.report.case_file;
    if (!run.field || file.empty() || heads.contains(file)) continue;
    auto head = load_head(file, progress);
    if (!head) return tl::unexpected(head.error());
    if (!run.report.model_id.empty() && head->model_id != run.report.model_id) {
      // Outlines and gravity of another model on these fields would look right and be wrong.
      return invalid(file + ": builds model " + head->model_id + ", but scenario \"" +
                     run.report.scenario + "\" was recorded with model " + run.report.model_id +
                     "; the case has changed since");
    }
    heads.emplace(file, std::move(*head));
  }
  return heads;
}

// A page takes at most 5 MB. Of the pictures so many bytes are embedded, in the order in which
// they are drawn; base64 makes four of three.
constexpr std::size_t kMostEmbedded = 3'400'000;
constexpr int kMostColumns = 1600;

// Writes figures and slides into the folder as they are drawn, and keeps what the page shows.
class Pictures {
 public:
  explicit Pictures(const fs::path& out) : out_(out) {}

  Status add(const Figure& figure, std::optional<std::size_t> group) {
    PagePicture shown;
    shown.caption = figure.caption;
    shown.file_name = figure.file_name;
    shown.group = group;
    if (!figure.svg.empty()) {
      shown.svg = figure.svg;
      pictures.push_back(std::move(shown));
      return io::write_file(out_ / figure.file_name, figure.svg);
    }
    auto webp = written(figure.file_name, figure.image);
    if (!webp) return tl::unexpected(webp.error());
    shown.webp = std::move(*webp);
    shown.width = figure.image.cols / kPixelRatio;
    shown.height = figure.image.rows / kPixelRatio;
    pictures.push_back(std::move(shown));
    return {};
  }

  Status add(const Slide& slide, std::size_t group) {
    PageSlide page{.positions = {}, .caption = slide.caption, .group = group};
    bool whole = true;
    for (const SlidePosition& position : slide.positions) {
      auto webp = written(slide.file_name + "-" + position.label + ".png", position.image);
      if (!webp) return tl::unexpected(webp.error());
      whole = whole && !webp->empty();
      page.positions.push_back({position.label, std::move(*webp)});
      page.width = position.image.cols;
      page.height = position.image.rows;
    }
    if (whole) slides.push_back(std::move(page));
    if (!whole) {
      pictures.push_back({slide.caption, {}, {}, slide.file_name + "-*.png", 0, 0, group});
    }
    return {};
  }

  std::vector<PagePicture> pictures;
  std::vector<PageSlide> slides;

 private:
  // The PNG into the folder; returns what is embedded, nothing when the page is full.
  Result<std::string> written(const std::string& name, const cv::Mat& image) {
    const auto png = encode_png(name, image);
    if (!png) return tl::unexpected(png.error());
    if (Status ok = io::write_file(out_ / name, *png); !ok) return tl::unexpected(ok.error());
    auto webp = encode_webp(name, image, kMostColumns);
    if (!webp) return webp;
    if (embedded_ + webp->size() > kMostEmbedded) return std::string();
    embedded_ += webp->size();
    return webp;
  }

  const fs::path& out_;
  std::size_t embedded_ = 0;
};

// First of every group what tells most, so that a page of many groups shows that of each.
Status draw_pictures(const std::vector<ReportedRun>& runs, const std::vector<RunGroup>& groups,
                     const std::map<std::string, Head>& heads, const Progress& progress,
                     Pictures& pictures) {
  Status ok;
  const auto add = [&](const std::optional<Figure>& figure, std::optional<std::size_t> group) {
    if (figure && ok) ok = pictures.add(*figure, group);
  };
  add(recovery_figure(groups, runs), {});
  add(error_time_figure(runs), {});
  std::vector<std::vector<Figure>> slices(groups.size());
  for (std::size_t g = 0; g < groups.size(); ++g) {
    report(progress, "draw", static_cast<double>(g) / static_cast<double>(groups.size()));
    for (const auto& index : {groups[g].contact, groups[g].fixed}) {
      if (!index) continue;
      for (const Figure& figure : course_figures(groups[g], runs[*index].report)) add(figure, g);
    }
    const auto head = heads.find(runs[groups[g].any()].report.case_file);
    if (head == heads.end()) continue;
    for (const Slide& slide : warped_slices(groups[g], runs, head->second)) {
      if (ok) ok = pictures.add(slide, g);
    }
    slices[g] = slice_figures(groups[g], runs, head->second);
    if (!slices[g].empty()) add(slices[g].front(), g);
    for (Figure& figure : slices[g]) {
      if (figure.file_name.starts_with("sd-")) add(figure, g);
    }
  }
  for (std::size_t g = 0; g < groups.size(); ++g) {
    for (std::size_t i = 1; i < slices[g].size(); ++i) {
      if (!slices[g][i].file_name.starts_with("sd-")) add(slices[g][i], g);
    }
    for (const auto& index : {groups[g].contact, groups[g].fixed}) {
      if (index) add(convergence_figure(groups[g], runs[*index].report), g);
    }
  }
  report(progress, "draw", 1.0);
  return ok;
}

}  // namespace

Status write_report(const ReportOptions& options, const Progress& progress) {
  const auto runs = load_runs(options);
  if (!runs) return tl::unexpected(runs.error());
  const auto heads = load_heads(*runs, progress);
  if (!heads) return tl::unexpected(heads.error());
  std::error_code error;
  fs::create_directories(options.out, error);
  if (error || !fs::is_directory(options.out)) {
    return fail(ErrorCode::kWriteFailed,
                options.out.string() + ": is no folder and cannot be made one");
  }

  const std::vector<RunGroup> groups = group_runs(*runs);
  Pictures pictures(options.out);
  if (Status ok = draw_pictures(*runs, groups, *heads, progress, pictures); !ok) return ok;
  if (Status ok = io::write_file(options.out / "report.html",
                                 html_page(*runs, groups, pictures.pictures, pictures.slides));
      !ok)
    return ok;
  std::vector<RunReport> merged;
  for (const ReportedRun& run : *runs) merged.push_back(run.report);
  return write_reports(options.out / "report.json", merged);
}

}  // namespace brainshift::client

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

std::vector<Figure> draw_figures(const std::vector<ReportedRun>& runs,
                                 const std::vector<RunGroup>& groups,
                                 const std::map<std::string, Head>& heads,
                                 const Progress& progress) {
  std::vector<Figure> figures;
  figures.push_back(recovery_figure(groups, runs));
  if (auto figure = error_time_figure(runs)) figures.push_back(std::move(*figure));
  for (std::size_t g = 0; g < groups.size(); ++g) {
    report(progress, "draw", static_cast<double>(g) / static_cast<double>(groups.size()));
    const RunGroup& group = groups[g];
    for (const auto& index : {group.contact, group.fixed}) {
      if (index && !runs[*index].report.trace.empty()) {
        figures.push_back(convergence_figure(group, runs[*index].report));
      }
    }
    const auto head = heads.find(runs[group.any()].report.case_file);
    if (head == heads.end()) continue;
    for (Figure& figure : slice_figures(group, runs, head->second))
      figures.push_back(std::move(figure));
  }
  report(progress, "draw", 1.0);
  return figures;
}

// Writes the pictures of every position, too.
Result<std::vector<PageSlide>> write_slides(const std::vector<ReportedRun>& runs,
                                            const std::vector<RunGroup>& groups,
                                            const std::map<std::string, Head>& heads,
                                            const fs::path& out) {
  std::vector<PageSlide> slides;
  for (const RunGroup& group : groups) {
    const auto head = heads.find(runs[group.any()].report.case_file);
    if (head == heads.end()) continue;
    for (const Slide& slide : warped_slices(group, runs, head->second)) {
      PageSlide page;
      page.caption = slide.caption;
      for (const SlidePosition& position : slide.positions) {
        const std::string name = slide.file_name + "-" + position.label + ".png";
        auto png = encode_png(name, position.image);
        if (!png) return tl::unexpected(png.error());
        if (Status ok = io::write_file(out / name, *png); !ok) return tl::unexpected(ok.error());
        page.positions.push_back({position.label, std::move(*png)});
        page.width = position.image.cols;
        page.height = position.image.rows;
      }
      slides.push_back(std::move(page));
    }
  }
  return slides;
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
  std::vector<PagePicture> pictures;
  for (const Figure& figure : draw_figures(*runs, groups, *heads, progress)) {
    auto png = encode_png(figure.file_name, figure.image);
    if (!png) return tl::unexpected(png.error());
    if (Status ok = io::write_file(options.out / figure.file_name, *png); !ok) return ok;
    pictures.push_back({std::move(*png), figure.caption, figure.image.cols / kPixelRatio,
                        figure.image.rows / kPixelRatio});
  }
  const auto slides = write_slides(*runs, groups, *heads, options.out);
  if (!slides) return tl::unexpected(slides.error());
  if (Status ok =
          io::write_file(options.out / "report.html", html_page(*runs, groups, pictures, *slides));
      !ok)
    return ok;
  std::vector<RunReport> merged;
  for (const ReportedRun& run : *runs) merged.push_back(run.report);
  return write_reports(options.out / "report.json", merged);
}

}  // namespace brainshift::client

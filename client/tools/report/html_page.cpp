// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/report/html_page.hpp"

#include <fmt/format.h>

#include "client/tools/report/html_table.hpp"
#include "common/io/files/binary_codec.hpp"

namespace brainshift::client {
namespace {

// Colours by role, given twice: light and dark. Pictures keep their own white ground in both.
constexpr const char* kStyle = R"(
:root { color-scheme: light dark; --ground: #ffffff; --ink: #1c1c1c; --soft: #5a5a5a; --rule: #d4d4d4;
        --head: #f1f3f5; --paper: #eef4fa; --warn: #b34700;
        --good: #0072b2; --caution: #e69f00; --unusable: #a50f15; }
@media (prefers-color-scheme: dark) {
  :root { --ground: #16181b; --ink: #e8e8e8; --soft: #a8a8a8; --rule: #3a3e44; --head: #22262b;
          --paper: #1b2733; --warn: #ffb066;
          --good: #56b4e9; --caution: #f0c75e; --unusable: #ff7b6b; } }
body { background: var(--ground); color: var(--ink); font: 16px/1.5 system-ui, sans-serif;
       max-width: 72rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.7rem; margin-bottom: 0.2rem; } h2 { font-size: 1.25rem; margin-top: 2.2rem; }
p.note { border-left: 4px solid var(--warn); padding-left: 0.8rem; }
.soft, figcaption { color: var(--soft); }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-size: 0.9rem; font-variant-numeric: tabular-nums; }
th, td { border-bottom: 1px solid var(--rule); padding: 0.3rem 0.7rem; text-align: right; white-space: nowrap; }
thead th { background: var(--head); vertical-align: bottom; }
tbody th { text-align: left; font-weight: normal; white-space: normal; min-width: 15rem; }
.paper { background: var(--paper); }
figure { margin: 1.5rem 0; } figure img { max-width: 100%; height: auto; border: 1px solid var(--rule); border-radius: 6px; background: #ffffff; }
figcaption { font-size: 0.9rem; }
p.headline { font-size: 1.25rem; margin: 1.4rem 0 0.2rem; } p.more { margin: 0.1rem 0 0.1rem 1rem; }
figure svg { max-width: 100%; height: auto; display: block; } rect.hit:hover { fill: var(--ink); fill-opacity: 0.08; }
figure.pair { display: inline-block; vertical-align: top; margin: 0.5rem 1rem 1rem 0; max-width: 100%; }
table.fits { width: 100%; font-size: 0.82rem; } table.fits th, table.fits td { white-space: normal; padding: 0.3rem 0.4rem; min-width: 0; }
table.fits tr.paper th, table.fits tr.paper td { background: var(--paper); }
figure.slide { display: inline-block; margin: 0.5rem 1rem 1rem 0; max-width: 33rem; vertical-align: top; }
figure.slide input { position: absolute; opacity: 0; }
figure.slide label { display: inline-block; cursor: pointer; border: 2px solid var(--rule); padding: 0.15rem 0.9rem; margin: 0 0 0.4rem -2px; }
figure.slide input:checked + label { background: var(--good); color: var(--ground); border-color: var(--good); font-weight: 600; }
figure.slide input:focus-visible + label { outline: 3px solid var(--caution); }
.stack { display: grid; } .stack img { grid-area: 1 / 1; visibility: hidden; }
figure.slide input.p0:checked ~ .stack img.p0, figure.slide input.p1:checked ~ .stack img.p1,
figure.slide input.p2:checked ~ .stack img.p2 { visibility: visible; }
.failures { color: var(--warn); }
.words { display: inline-block; max-width: 24rem; white-space: normal; text-align: left; }
.verdict { border: 2px solid var(--rule); border-radius: 6px; padding: 0.05rem 0.45rem; white-space: nowrap; }
.verdict.good { border-color: var(--good); } .verdict.caution { border-color: var(--caution); border-style: dashed; }
.verdict.unusable { border-color: var(--unusable); border-style: double; border-width: 4px; font-weight: bold; }
)";

constexpr const char* kCitation =
    "S. Ji, D. W. Roberts, A. Hartov, K. D. Paulsen: <cite>Brain&ndash;skull contact boundary "
    "conditions in an inverse computational deformation model</cite>, Medical Image Analysis, "
    "2009; simulated case (patient 2), section 3.1, and section 4 for ICP. The value in brackets "
    "is not printed there but follows from its errors.";

std::string scalar_list(const RunReport& run) {
  std::string text;
  for (const auto& [name, value] : run.truth_scalars) {
    text += fmt::format("{}{} = {:.4g}", text.empty() ? "" : ", ", escape_html(name), value);
  }
  return text;
}

std::string scenario_list(const std::vector<ReportedRun>& runs,
                          const std::vector<RunGroup>& groups) {
  std::string html = "<ul>\n";
  for (const RunGroup& group : groups) {
    const RunReport& run = runs[group.any()].report;
    html += "<li><strong>" + escape_html(run.scenario) + "</strong>: case " +
            escape_html(run.case_id) + ", method " + escape_html(run.method);
    if (run.seed) html += ", seed " + std::to_string(*run.seed);
    if (!run.model_id.empty()) html += ", model " + escape_html(run.model_id);
    const std::string scalars = scalar_list(run);
    if (!scalars.empty()) html += "; truth: " + scalars;
    html += "</li>\n";
  }
  return html + "</ul>\n";
}

std::string section(const std::string& title, const std::string& body) {
  return body.empty() ? "" : "<h2>" + title + "</h2>\n" + body;
}

std::string picture(const PagePicture& picture) {
  const std::string caption =
      "<figcaption>" + escape_html(picture.caption) + "</figcaption></figure>\n";
  if (!picture.svg.empty()) return "<figure>" + picture.svg + caption;
  return "<figure class=\"pair\"><img alt=\"" + escape_html(picture.caption) + "\" width=\"" +
         std::to_string(picture.width) + "\" height=\"" + std::to_string(picture.height) +
         "\" src=\"data:image/webp;base64," + io::base64_encode(picture.webp) + "\">" + caption;
}

std::string slide(const PageSlide& slide, std::size_t number) {
  const std::string name = "slide" + std::to_string(number);
  std::string inputs, images;
  for (std::size_t i = 0; i < slide.positions.size(); ++i) {
    const std::string id = name + "-" + std::to_string(i);
    const std::string label = escape_html(slide.positions[i].label);
    inputs += fmt::format(
        "<input type=\"radio\" name=\"{}\" id=\"{}\" class=\"p{}\"{}><label "
        "for=\"{}\">{}</label>\n",
        name, id, i, i == 1 ? " checked" : "", id, label);
    images += fmt::format(
        "<img class=\"p{}\" alt=\"{}\" width=\"{}\" height=\"{}\" "
        "src=\"data:image/webp;base64,{}\">",
        i, label, slide.width, slide.height, io::base64_encode(slide.positions[i].webp));
  }
  return "<figure class=\"slide\">" + inputs + "<div class=\"stack\">" + images +
         "</div><figcaption>" + escape_html(slide.caption) + "</figcaption></figure>\n";
}

// Pictures of one group, or with nullopt of all runs; what did not fit is named.
std::string pictures_of(std::optional<std::size_t> group,
                        const std::vector<PagePicture>& pictures) {
  std::string html, beside;
  for (const PagePicture& one : pictures) {
    if (one.group != group) continue;
    const bool here = !one.svg.empty() || !one.webp.empty();
    if (here) html += picture(one);
    if (!here) beside += (beside.empty() ? "" : ", ") + escape_html(one.file_name);
  }
  if (!beside.empty()) {
    html += "<p class=\"soft\">Beside this page, which is full, lie: " + beside + ".</p>\n";
  }
  return html;
}

std::string note(const std::string& text) { return "<p class=\"soft\">" + text + "</p>\n"; }

}  // namespace

std::string html_page(const std::vector<ReportedRun>& runs, const std::vector<RunGroup>& groups,
                      const std::vector<PagePicture>& pictures,
                      const std::vector<PageSlide>& slides) {
  std::string html =
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>brainshift report</title>\n<style>" +
      std::string(kStyle) + "</style></head>\n<body>\n";
  html +=
      "<h1>Brain shift: what the replays showed</h1>\n"
      "<p class=\"note\">Research software for simulation, replay and laboratory use. It is no "
      "medical device and must not guide the treatment of patients.</p>\n";
  for (const RunGroup& group : groups) html += headline(runs[group.any()].report);
  if (const std::string all = verdict(runs); !all.empty())
    html += "<p>" + escape_html(all) + "</p>\n";
  html += section("Failures", failure_list(runs));
  const bool truth = has_truth(runs);
  html += section(
      "In short",
      summary_table(runs) +
          note(
              "Each line is a run." +
              (truth
                   ? " The blue ones are published: " + std::string(kCitation) +
                         " Errors are means, at points of the tumour that were not measured and by "
                         "closest point at the craniotomy."
                   : std::string(" No truth is recorded."))));
  if (const std::string table = left_out_table(runs); !table.empty()) {
    html += section(
        "Left out and predicted",
        table + note("Mean &plusmn; standard deviation of distances. Landmarks one by one, "
                     "surfaces an eighth at a time. The measurement's own error is in them; "
                     "what all points share, such as a wrong registration, is recovered "
                     "with the rest and does not show."));
  }
  for (std::size_t g = 0; g < groups.size(); ++g) {
    std::string body;
    for (std::size_t i = 0; i < slides.size(); ++i) {
      if (slides[i].group == g) body += slide(slides[i], i);
    }
    body += pictures_of(g, pictures);
    const RunReport& run = runs[groups[g].any()].report;
    html += section(escape_html(run.scenario) + "<br><small class=\"soft\">method " +
                        escape_html(run.method) + "</small>",
                    body);
  }
  html += section("All runs in pictures", pictures_of({}, pictures));
  html += section("The runs", scenario_list(runs, groups));
  html += section(
      "Quality of the fields",
      quality_table(runs) +
          note("What the daemon says of each final update's field. &ldquo;Converged&rdquo; "
               "speaks of the algorithm only. Everything else on this page is taken from "
               "the last update that was usable. Strengths: in units of the case's standard "
               "deviations."));
  html += section(truth ? "Errors, beside the published ones" : "Misfit and contact",
                  error_table(runs) +
                      note("Mean &plusmn; standard deviation." +
                           (truth ? " Blue columns: " + std::string(kCitation) : std::string())));
  html +=
      section("Timings", timing_table(runs) +
                             note("Latency: from sending an observation to having received its "
                                  "final update, on the client's clock. Stages: medians reported "
                                  "by the daemon."));
  if (const std::string sources = source_table(runs); !sources.empty()) {
    html +=
        section("Instruments",
                sources + note("Of each run's last update. Chi-square: how far an instrument lies "
                               "from what the others and the prior predict for it, beside its "
                               "expectation; p: probability of more by chance."));
  }
  html += section("Left out of the model", left_out_list(runs));
  return html + "</body></html>\n";
}

}  // namespace brainshift::client

// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/ablations/ablation_patient.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <utility>

#include "common/core/random.hpp"
#include "common/core/stopwatch.hpp"
#include "tests/evidence/estimate_session.hpp"
#include "tests/simulation/variation.hpp"
#include "tests/support/gross_errors.hpp"

namespace brainshift::ablations {
namespace {

constexpr std::array kMotions = {"joint-tangential", "joint-mixed", "joint-distension", "resection",
                                 "retraction",       "mannitol",    "outliers"};

// Sag of a brain that shrinks by 2 to 4 % of its volume or, every other time, in one hemisphere.
client::Scenario mannitol(std::uint64_t seed) {
  client::Scenario scenario = client::vary(*client::find_scenario("joint-sag"), seed);
  Random random(seed);
  scenario.volume = {-kMinShrinkage * (1.0 + random.uniform()), seed % 2 == 0};
  return scenario;
}

client::Scenario motion(const AblationSurgery& surgery) {
  if (surgery.truth == "mannitol") return mannitol(surgery.seed);
  const char* name = surgery.truth == "outliers" ? "joint-sag" : surgery.truth.c_str();
  return client::vary(*client::find_scenario(name), surgery.seed);
}

bool is_motion(const std::string& truth) {
  return std::find(kMotions.begin(), kMotions.end(), truth) != kMotions.end();
}

using evidence::Anew;
using evidence::EvidenceFigures;
using evidence::EvidenceKey;
using surgeries::Row;
using surgeries::RowFile;

// A meshed and prepared head, and the surgeries that were played on it.
class Stage {
 public:
  Stage(bench::Head head, int patient) : head_(std::move(head)), twin_(head_, patient, "") {}
  Stage(const Stage&) = delete;  // the twin refers to the head
  Stage& operator=(const Stage&) = delete;

  const bench::Head& head() const { return head_; }

  Result<const evidence::PlayedSurgery*> surgery(const AblationSurgery& wanted) {
    const auto key = std::pair{wanted.truth, wanted.seed};
    const auto found = played_.find(key);
    if (found != played_.end()) return &found->second;
    auto played = play(twin_, wanted);
    if (!played) return fail(played.error().code, wanted.truth + ": " + played.error().message);
    return &played_.emplace(key, std::move(*played)).first->second;
  }

 private:
  bench::Head head_;
  evidence::PatientTwin twin_;
  std::map<std::pair<std::string, std::uint64_t>, evidence::PlayedSurgery> played_;
};

class AblatedPatient {
 public:
  AblatedPatient(const AblationPlan& plan, RowFile& rows) : plan_(plan), rows_(rows) {}

  Status play(const Part& part, const Told& told) {
    const std::vector<AblationSurgery> missing = missing_of(part);
    if (missing.empty()) return {};
    const Stopwatch watch;
    const auto stage = stage_for(part);
    if (!stage) return tl::unexpected(stage.error());
    auto session = evidence::begin_session((*stage)->head(), part.variant);
    if (!session) return tl::unexpected(session.error());
    const double prepared_s = watch.seconds();
    for (const AblationSurgery& surgery : missing) {
      if (Status ok = play(part, surgery, **stage, *session); !ok) return ok;
    }
    own_mesh_.reset();
    if (told) {
      told(part.variant.name, static_cast<int>(missing.size()), prepared_s, watch.seconds());
    }
    return {};
  }

 private:
  std::vector<AblationSurgery> missing_of(const Part& part) const {
    std::vector<AblationSurgery> missing;
    if (part.slow && !plan_.first) return missing;
    for (const AblationSurgery& one : plan_.surgeries) {
      RowFile::Key key = key_of(one).texts();
      key.push_back(part.variant.name);
      if (!rows_.has(key)) missing.push_back(one);
    }
    return missing;
  }

  EvidenceKey key_of(const AblationSurgery& surgery) const {
    return {plan_.head, plan_.patient, surgery.truth, surgery.seed};
  }

  // The patient's head, which most variants share, or one of the variant's own.
  Result<Stage*> stage_for(const Part& part) {
    const bool own = part.variant.anew == Anew::kMesh;
    std::optional<Stage>& stage = own ? own_mesh_ : shared_;
    if (stage) return &*stage;
    CaseConfig config = plan_.config;
    config.condensed.deadline_ms = evidence::kNoDeadline_ms;
    if (own) part.variant.change(config);
    const bench::MeshWish wish{config.case_id, plan_.thousand_nodes};
    auto head = bench::make_head(std::move(config), wish);
    if (!head) return tl::unexpected(head.error());
    stage.emplace(std::move(*head), plan_.patient);
    return &*stage;
  }

  Status play(const Part& part, const AblationSurgery& surgery, Stage& stage,
              evidence::EstimateSession& session) {
    const auto played = stage.surgery(surgery);
    if (!played) return tl::unexpected(played.error());
    EvidenceFigures figures;
    figures.key = key_of(surgery);
    figures.nodes = stage.head().model->mesh.num_nodes();
    const auto rows = evidence::estimate_rows(stage.head(), session, **played, figures);
    if (!rows) return fail(rows.error().code, surgery.truth + ": " + rows.error().message);
    std::vector<Row> named;
    for (const Row& row : *rows) named.push_back(with_variant(row, part.variant.name));
    return rows_.append(named);
  }

  const AblationPlan& plan_;
  RowFile& rows_;
  std::optional<Stage> shared_, own_mesh_;
};

}  // namespace

const std::vector<std::string>& truth_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const evidence::TruthKind& kind : evidence::truth_kinds()) {
      if (!kind.calculix) all.push_back(kind.name);
    }
    all.insert(all.end(), kMotions.begin(), kMotions.end());
    return all;
  }();
  return names;
}

std::vector<AblationSurgery> surgeries_of(int patient, std::uint64_t first_seed,
                                          const std::vector<std::string>& truths) {
  const std::uint64_t seed = first_seed + static_cast<std::uint64_t>(patient - 1);
  std::vector<AblationSurgery> surgeries;
  for (const std::string& truth : truths) {
    const int seeds = is_motion(truth) ? kSeedsPerMotion : 1;
    for (int k = 0; k < seeds; ++k) {
      surgeries.push_back({truth, seed + static_cast<std::uint64_t>(k * evidence::kPatients)});
    }
  }
  return surgeries;
}

Result<evidence::PlayedSurgery> play(evidence::PatientTwin& twin, const AblationSurgery& surgery) {
  if (!is_motion(surgery.truth)) {
    return twin.play(*evidence::find_truth(surgery.truth), surgery.seed);
  }
  auto played = twin.play(motion(surgery), surgery.seed);
  if (!played || !played->surgery || surgery.truth != "outliers") return played;
  Random random(surgery.seed);
  for (Observation& one : played->surgery->observations) {
    one = test_support::with_gross_errors(std::move(one), kOutliers, random);
  }
  return played;
}

Row with_variant(const Row& row, const std::string& variant) {
  Row named;
  for (const auto& [name, text] : row) {
    named.emplace_back(name, text);
    if (name == "seed") named.emplace_back("variant", variant);
  }
  return named;
}

Result<RowFile> open_ablations(const std::filesystem::path& path, bool resume) {
  const Row columns = with_variant(evidence::refused_row({}, ""), "");
  return RowFile::open(path, columns, kAblationKey, resume);
}

Status play_patient(const AblationPlan& plan, RowFile& rows, const Told& told) {
  AblatedPatient patient(plan, rows);
  for (const Part& part : plan.parts) {
    if (Status ok = patient.play(part, told); !ok) {
      return fail(ok.error().code, part.variant.name + ": " + ok.error().message);
    }
  }
  return {};
}

}  // namespace brainshift::ablations

// SPDX-License-Identifier: GPL-3.0-or-later
// A surgery file and a model file, cut or flipped at random places, half of each. The real programs
// read every one: `brainshift journal check` and `brainshiftd serve`. Neither may crash or take
// changed content for good.
#include <algorithm>
#include <fstream>
#include <iterator>
#include <random>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "common/io/recording/surgery_file.hpp"
#include "tests/faults/feed.hpp"
#include "tests/faults/process.hpp"
#include "tests/faults/settings.hpp"

namespace brainshift::faults {
namespace {

namespace fs = std::filesystem;

// A file that is damaged at one place at a time, and mended again.
class Damaged {
 public:
  explicit Damaged(fs::path file) : path_(std::move(file)), good_(content_of(path_)) {
    if (good_.empty()) throw std::runtime_error(path_.string() + ": cannot be read");
  }
  std::size_t size() const { return good_.size(); }

  void flip(std::size_t at, int bit) {
    const char changed = static_cast<char>(good_[at] ^ (1 << bit));
    put(at, std::string_view(&changed, 1));
  }
  void cut(std::size_t kept) { fs::resize_file(path_, kept); }
  // Puts back what lies from `at` on, or the one byte.
  void mend(std::size_t at, bool was_cut) {
    put(at, std::string_view(good_).substr(at, was_cut ? std::string::npos : 1));
  }

 private:
  void put(std::size_t at, std::string_view bytes) const {
    std::fstream stream(path_, std::ios::binary | std::ios::in | std::ios::out);
    stream.seekp(static_cast<std::streamoff>(at));
    stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    stream.close();
    if (!stream) throw std::runtime_error(path_.string() + ": cannot be written");
  }

  fs::path path_;
  std::string good_;
};

using Records = std::vector<io::SurgeryRecord>;

struct Visited {
  Records records;
  bool whole = false;
};
Visited visit(const fs::path& path) {
  Visited visited;
  const auto file = io::SurgeryFile::open_damaged(path);
  if (!file) return visited;
  visited.whole = file->visit([&](const io::SurgeryRecord& record) -> Status {
                        visited.records.push_back(record);
                        return {};
                      })
                      .has_value();
  return visited;
}

bool is_prefix(const Records& found, const Records& all) {
  return found.size() <= all.size() &&
         std::equal(found.begin(), found.end(), all.begin(), [](const auto& a, const auto& b) {
           return a.kind == b.kind && a.sequence == b.sequence && a.recorded_ns == b.recorded_ns &&
                  a.payload == b.payload;
         });
}

struct Counts {
  int crashes = 0, taken_for_good = 0;
  int harmless = 0;  // accepted, with every record as it was written
  int several_lines = 0;
  double kept_pct = 0.0;  // of the records, mean over the cuts
  int cuts = 0;
};

bool is_one_line(const std::string& text) {
  return !text.empty() && text.find('\n') == text.size() - 1;
}

Counts damage_surgery(const fs::path& path, int count, std::mt19937& random) {
  const Records all = visit(path).records;
  Damaged file(path);
  Counts counts;
  for (int i = 0; i < count; ++i) {
    const bool cut = i % 2 == 0;
    const std::size_t at = random() % file.size();
    if (cut) {
      file.cut(at);
    } else {
      file.flip(at, static_cast<int>(random() % 8));
    }
    const auto checked = run({brainshift(), "journal", "check", path});
    const Visited visited = visit(path);
    file.mend(at, cut);
    const bool unchanged = visited.whole && visited.records.size() == all.size();
    const bool good = checked.exit_status == 0;
    counts.crashes += checked.exit_status == 0 || checked.exit_status == 2 ? 0 : 1;
    counts.harmless += good && unchanged && !cut ? 1 : 0;
    counts.taken_for_good +=
        !is_prefix(visited.records, all) || (good && (cut || !unchanged)) ? 1 : 0;
    if (cut) {
      ++counts.cuts;
      counts.kept_pct +=
          100.0 * static_cast<double>(visited.records.size()) / static_cast<double>(all.size());
    }
    show_progress("damaged surgery files", i + 1, count);
  }
  counts.kept_pct /= std::max(1, counts.cuts);
  return counts;
}

Counts damage_model(const fs::path& path, int count, std::mt19937& random) {
  Damaged file(path);
  const fs::path config = path.parent_path() / "damaged.yaml";
  std::ofstream(config) << "endpoint: tcp://127.0.0.1:*\n";
  Counts counts;
  for (int i = 0; i < count; ++i) {
    const bool cut = i % 2 == 0;
    // Half of the places lie in the header and what HDF5 keeps at the front.
    const std::size_t at = random() % (i % 4 < 2 ? file.size() : std::size_t{4096});
    if (cut) {
      file.cut(at);
    } else {
      file.flip(at, static_cast<int>(random() % 8));
    }
    // A daemon that serves it does not end by itself, and is killed: status -1.
    const auto served = run({brainshiftd(), "serve", "--config", config, "--model", path}, 10.0);
    file.mend(at, cut);
    const bool serves = served.out.rfind("listening on ", 0) == 0;
    counts.taken_for_good += serves ? 1 : 0;
    counts.crashes += !serves && served.exit_status != 2 ? 1 : 0;
    counts.several_lines += !serves && !is_one_line(served.err) ? 1 : 0;
    show_progress("damaged model files", i + 1, count);
  }
  return counts;
}

}  // namespace

void run_damaged_files(const Settings& settings, Tally& tally) {
  std::mt19937 random(settings.seed);
  const fs::path surgery = settings.work / "damaged.surgery";
  fs::remove(surgery);
  Feed(settings.surgery).write(surgery, 60);
  const Counts journal = damage_surgery(surgery, settings.count, random);
  tally.shown("places in a surgery file", settings.count);
  tally.equals("surgery files: crashes of brainshift journal check", journal.crashes, 0);
  tally.equals("surgery files: changed and taken for good", journal.taken_for_good, 0);
  tally.shown("surgery files: flips of bytes that mean nothing", journal.harmless);
  // A cut at a random place keeps half of the file in the mean.
  tally.at_least("surgery files: mean share of records recovered of a cut file %", journal.kept_pct,
                 40.0);

  const fs::path model = settings.work / "damaged.h5";
  fs::copy_file(settings.model, model, fs::copy_options::overwrite_existing);
  const Counts models = damage_model(model, settings.count, random);
  fs::remove(model);
  tally.shown("places in a model file", settings.count);
  tally.equals("model files: crashes of brainshiftd serve", models.crashes, 0);
  tally.equals("model files: changed and served", models.taken_for_good, 0);
  tally.equals("model files: not refused in one line", models.several_lines, 0);
}

}  // namespace brainshift::faults

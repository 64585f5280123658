// SPDX-License-Identifier: GPL-3.0-or-later
#include <CLI/CLI.hpp>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "client/tools/cli/command.hpp"
#include "client/tools/journal/journal_check.hpp"
#include "client/tools/journal/journal_copy.hpp"
#include "client/tools/journal/journal_export.hpp"
#include "common/io/files/file_access.hpp"
#include "common/io/recording/surgery_file.hpp"

namespace brainshift::client {
namespace {

namespace fs = std::filesystem;

struct JournalArguments {
  std::vector<fs::path> files;
  fs::path file;
  fs::path out;
  fs::path csv;
  fs::path fields_file;
  FieldSeries fields;
  std::uint64_t first = 0;
  std::uint64_t last = 0;
};

// Every file is reported; the first that is not good decides how the command ends.
Status run_check(const std::vector<fs::path>& files) {
  Status status;
  const auto keep_first = [&](const Error& error) {
    if (status) status = tl::unexpected(error);
  };
  for (const fs::path& file : files) {
    const auto checked = check_journal(file);
    if (!checked) {
      if (!status) print_error(status.error().message);
      status = tl::unexpected(checked.error());
      continue;
    }
    for (const std::string& line : report_lines(*checked)) std::puts(line.c_str());
    if (checked->broken) keep_first(*checked->broken);
  }
  return status;
}

Status export_tables(const JournalArguments& arguments) {
  const bool fields_wanted = !arguments.fields.folder.empty() || !arguments.fields_file.empty();
  if (arguments.csv.empty() && !fields_wanted) {
    return fail(ErrorCode::kInvalidArgument,
                "journal export: give --csv, or --vtu or --hdf5 with --model");
  }
  if (fields_wanted == arguments.fields.model.empty()) {
    return fail(ErrorCode::kInvalidArgument,
                "journal export: --model needs --vtu or --hdf5, and they need it");
  }
  const auto file = io::SurgeryFile::open(arguments.file);
  if (!file) return tl::unexpected(file.error());
  if (!arguments.csv.empty()) {
    const auto csv = records_csv(*file, arguments.file);
    if (!csv) return tl::unexpected(csv.error());
    if (Status ok = io::write_file(arguments.csv, *csv); !ok) return ok;
    std::printf("%s: %llu records\n", arguments.csv.c_str(),
                static_cast<unsigned long long>(file->state().records));
  }
  if (!arguments.fields.folder.empty()) {
    const auto fields = write_field_series(*file, arguments.file, arguments.fields);
    if (!fields) return tl::unexpected(fields.error());
    std::printf("%s: %d fields\n", arguments.fields.folder.c_str(), *fields);
  }
  if (arguments.fields_file.empty()) return {};
  const auto fields =
      write_field_file(*file, arguments.file, arguments.fields.model, arguments.fields_file);
  if (!fields) return tl::unexpected(fields.error());
  std::printf("%s: %d fields\n", arguments.fields_file.c_str(), *fields);
  return {};
}

Status finish(const Result<CopiedJournal>& copied, const fs::path& out) {
  if (!copied) return tl::unexpected(copied.error());
  std::printf("%s: %llu of %llu records\n", out.c_str(),
              static_cast<unsigned long long>(copied->kept),
              static_cast<unsigned long long>(copied->of));
  if (copied->broken) std::printf("  left out from: %s\n", copied->broken->message.c_str());
  return {};
}

CLI::App* add_journal_action(CLI::App& journal, const std::string& name, const std::string& text,
                             const std::string& examples) {
  CLI::App* action = journal.add_subcommand(name, text);
  action->footer(examples);
  return action;
}

void add_check(CLI::App& journal, const std::shared_ptr<JournalArguments>& arguments,
               Status& status) {
  CLI::App* action = add_journal_action(
      journal, "check", "Report what files hold, and whether every record is as it was written.",
      "Examples:\n"
      "  brainshift journal check journal/*.surgery\n"
      "  brainshift journal check crashed.surgery && brainshift replay crashed.surgery --report "
      "r.json\n"
      "A file that was not closed is no error: it crashed, is still written, or lost its -wal "
      "file\n"
      "when it was copied. Exit status: 0 all records are good; 2 a file is damaged or is not a "
      "surgery file.");
  action->add_option("files", arguments->files, "surgery files (.surgery)")->required();
  action->callback([arguments, &status] { status = run_check(arguments->files); });
}

void add_export(CLI::App& journal, const std::shared_ptr<JournalArguments>& arguments,
                Status& status) {
  CLI::App* action = add_journal_action(
      journal, "export",
      "Write a table of the records, and the fields for ParaView or as one HDF5 file.",
      "Examples:\n"
      "  brainshift journal export paper.surgery --csv paper.csv\n"
      "  brainshift journal export journal/colin27-20250131T120000Z-1.surgery --csv records.csv "
      "\\\n"
      "    --vtu fields --hdf5 fields.h5 --model colin27.h5\n"
      "The table has a row per record: kind, sequence, source, time, bytes; of decisions the\n"
      "outcome; of updates status, quality, flags, times of the stages, active slaves and the\n"
      "largest motion. The series has a .vtu per usable update and a .pvd that lists them by "
      "time.\n"
      "The HDF5 file holds the mesh, and a group per usable update with displacement_mm (n x 3) "
      "and\n"
      "sd_mm (n), both in patient RAS. A broken file must be repaired first.");
  action->add_option("file", arguments->file, "surgery file (.surgery)")->required();
  action->add_option("--csv", arguments->csv, "table to write; replaced if it exists");
  action->add_option("--vtu", arguments->fields.folder, "folder for the fields; needs --model");
  action->add_option("--hdf5", arguments->fields_file,
                     "one file of all fields to write (.h5); needs --model");
  action->add_option("--model", arguments->fields.model,
                     "prepared model (.h5) that the surgery was recorded with");
  action->callback([arguments, &status] { status = export_tables(*arguments); });
}

void add_repair(CLI::App& journal, const std::shared_ptr<JournalArguments>& arguments,
                Status& status) {
  CLI::App* action = add_journal_action(
      journal, "repair", "Write the valid prefix of a file to a new one.",
      "Example:\n"
      "  brainshift journal repair damaged.surgery --out mended.surgery\n"
      "The original is only read. Everything in front of the first broken record is kept; the gap\n"
      "of the new file says where it comes from. Of a crashed file it makes a closed one.");
  action->add_option("file", arguments->file, "surgery file (.surgery)")->required();
  action->add_option("--out", arguments->out, "surgery file to make; must not exist")->required();
  action->callback([arguments, &status] {
    status = finish(repair_journal(arguments->file, arguments->out), arguments->out);
  });
}

void add_trim(CLI::App& journal, const std::shared_ptr<JournalArguments>& arguments,
              Status& status) {
  CLI::App* action = add_journal_action(
      journal, "trim", "Write a range of observations, with their updates, to a new file.",
      "Example, observations 100 to 250 of every source:\n"
      "  brainshift journal trim long.surgery --from 100 --to 250 --out part.surgery\n"
      "The original is only read, and every record of it must be good.");
  action->add_option("file", arguments->file, "surgery file (.surgery)")->required();
  action->add_option("--from", arguments->first, "first sequence to keep")->required();
  action->add_option("--to", arguments->last, "last sequence to keep")->required();
  action->add_option("--out", arguments->out, "surgery file to make; must not exist")->required();
  action->callback([arguments, &status] {
    status =
        finish(trim_journal(arguments->file, arguments->first, arguments->last, arguments->out),
               arguments->out);
  });
}

}  // namespace

void add_journal(CLI::App& app, Status& status) {
  auto arguments = std::make_shared<JournalArguments>();
  CLI::App* journal = app.add_subcommand(
      "journal", "Check, export, repair and trim recorded surgeries (docs/journal.md).");
  journal->require_subcommand(1);
  journal->footer(
      "Examples:\n"
      "  brainshift journal check journal/*.surgery\n"
      "  brainshift journal export paper.surgery --csv paper.csv\n"
      "  brainshift journal repair damaged.surgery --out mended.surgery\n"
      "  brainshift journal trim long.surgery --from 100 --to 250 --out part.surgery\n"
      "Each has a --help of its own.");
  add_check(*journal, arguments, status);
  add_export(*journal, arguments, status);
  add_repair(*journal, arguments, status);
  add_trim(*journal, arguments, status);
}

}  // namespace brainshift::client

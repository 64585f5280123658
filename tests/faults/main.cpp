// SPDX-License-Identifier: GPL-3.0-or-later
// faults TOPIC: one row of the suite of `make faults` (docs/faults.md). Drives
// the real daemon, the real client library and the real command line. Figures go to
// $BRAINSHIFT_STUDY_DIR, when it is set, and to the terminal.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <map>
#include <string>

#include "tests/faults/settings.hpp"

namespace brainshift::faults {
namespace {

struct Topic {
  void (*run)(const Settings&, Tally&);
  const char* about;
  // Of the long form and of the short one.
  int count, brief_count;
  double seconds, brief_seconds;
};

const std::map<std::string, Topic> kTopics = {
    {"kills", {run_kills, "kill -9 during replays, COUNT times", 300, 2, 0, 0}},
    {"files", {run_damaged_files, "files cut or flipped at COUNT places", 1000, 60, 0, 0}},
    {"messages", {run_bad_messages, "COUNT bad messages", 1000000, 20000, 0, 0}},
    {"unfinished", {run_unfinished_messages, "COUNT MiB of unfinished messages", 1024, 160, 0, 0}},
    {"stalled", {run_stalled_viewer, "a viewer that does not read for SECONDS", 3, 1, 30, 2}},
    {"viewers",
     {run_many_viewers, "16 viewers of a region against one, SECONDS per turn", 0, 0, 20, 1}},
    {"rate", {run_sixty_hertz, "60 Hz for SECONDS", 0, 0, 600, 20}},
    {"half-open", {run_half_open, "COUNT connections that swallow everything", 20, 2, 0, 0}},
    {"crowds",
     {run_crowds, "COUNT raw connections; bad peers; few descriptors", 10000, 1000, 0, 0}},
    {"restart", {run_restart, "COUNT restarts with another patient's model", 10, 1, 0, 0}},
    {"clocks", {run_clocks, "clocks that are wrong", 0, 0, 0, 0}},
    {"cost",
     {run_cost, "latency with journal and keys and without, COUNT updates each", 2000, 20, 0, 0}},
    {"hang-ups",
     {run_hang_ups, "COUNT peers of each kind that close with much unread", 1000, 50, 0, 0}},
    {"choices", {run_choices, "a viewer that changes its choice COUNT times", 100000, 1000, 0, 0}},
    {"largest", {run_largest, "the largest observations back to back for SECONDS", 0, 0, 60, 2}},
    {"allocations",
     {run_allocations, "COUNT allocations that fail, one at a time", 1000, 40, 0, 0}},
    {"threads",
     {run_hardware_threads, "2 to 128 hardware threads, COUNT kinds of session on each", 4, 2, 0,
      0}},
};

int run_topic(const std::string& name, const Topic& topic, Settings settings, bool brief) {
  if (settings.count == 0) settings.count = brief ? topic.brief_count : topic.count;
  if (settings.seconds == 0.0) settings.seconds = brief ? topic.brief_seconds : topic.seconds;
  std::filesystem::create_directories(settings.work);
  settings.work = std::filesystem::absolute(settings.work);
  std::string command = "faults " + name;
  if (settings.count > 0) command += " --count " + std::to_string(settings.count);
  if (settings.seconds > 0.0) {
    command += " --seconds " + std::to_string(static_cast<int>(settings.seconds));
  }
  Tally tally(name, command, brief);
  try {
    topic.run(settings, tally);
  } catch (const std::exception& failure) {
    std::fprintf(stderr, "faults %s: %s\n", name.c_str(), failure.what());
    tally.equals("ended before its end", 1, 0);
  }
  return tally.all_hold() ? 0 : 1;
}

}  // namespace
}  // namespace brainshift::faults

int main(int argc, char** argv) {
  using namespace brainshift::faults;
  CLI::App app{"Drives the daemon through faults and loads, and counts what it must not do.",
               "faults"};
  app.require_subcommand(1);
  Settings settings;
  bool brief = false;
  for (const auto& [name, topic] : kTopics) {
    CLI::App* command = app.add_subcommand(name, topic.about);
    command->add_option("--model", settings.model, "model file of the case")->required();
    command->add_option("--surgery", settings.surgery, "surgery simulated with the case")
        ->required();
    command->add_option("--other-model", settings.other_model, "another patient's; for restart");
    command->add_option("--work", settings.work, "folder for raw figures and journals")->required();
    command->add_option("--count", settings.count, "instead of the topic's own");
    command->add_option("--seconds", settings.seconds, "instead of the topic's own");
    command->add_option("--seed", settings.seed, "of what is random")->capture_default_str();
    command->add_flag("--brief", brief, "the short form that the tests run");
  }
  app.footer("Exit status: 0 every check holds, 1 one does not, 2 bad usage.");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    std::fprintf(stderr, "faults: %s (see faults --help)\n", error.what());
    return 2;
  }
  const std::string name = app.get_subcommands().front()->get_name();
  return run_topic(name, kTopics.at(name), settings, brief);
}

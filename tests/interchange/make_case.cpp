// SPDX-License-Identifier: GPL-3.0-or-later
// interchange_case FOLDER: writes model.h5 and a.surgery, a journal of the toy patient with one
// good update of a known field. Elements of 5 mm, as in a head.
#include <cstdio>
#include <exception>
#include <filesystem>

#include "tests/support/toy_journal.hpp"

int main(int argc, char** argv) {
  using namespace brainshift;
  if (argc != 2) {
    std::fputs("usage: interchange_case FOLDER\n", stderr);
    return 2;
  }
  const std::filesystem::path folder = argv[1];
  try {
    const BrainModel model = test_support::toy_model(12);
    test_support::write_toy_model(folder / "model.h5", model);
    test_support::write_toy_journal(folder / "a.surgery", model,
                                    {test_support::toy_update(model, 1, Quality::kGood)});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "interchange_case: %s\n", error.what());
    return 1;
  }
  return 0;
}

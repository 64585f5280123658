// SPDX-License-Identifier: GPL-3.0-or-later
// A test's folder with a journal of the toy patient (tests/support/toy_journal.hpp).
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.hpp"
#include "tests/support/toy_journal.hpp"

namespace brainshift::client {

class SmallExport : public testing::Test {
 protected:
  UpdateMessage message(std::uint64_t sequence, Quality quality, double scale = 1.0) const {
    return test_support::toy_update(model, sequence, quality, scale);
  }
  // Replaces the journal.
  void write_updates(const std::vector<UpdateMessage>& messages) const {
    std::filesystem::remove(path);
    test_support::write_toy_journal(path, model, messages);
  }

  const BrainModel model = test_support::toy_model();
  const test_support::TemporaryFolder folder;
  const std::filesystem::path path = folder / "a.surgery";
};

}  // namespace brainshift::client

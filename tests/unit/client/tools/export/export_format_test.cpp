// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/export/export_format.hpp"

#include <gmock/gmock.h>

namespace brainshift::client {
namespace {

using testing::HasSubstr;

TEST(ExportFormat, EveryWordIsItsFormat) {
  for (const ExportFormat format : kAllExportFormats) {
    EXPECT_EQ(parse_formats({std::string(to_string(format))}).value(), ExportFormats{format});
  }
  EXPECT_EQ(parse_formats({"sd", "nrrd", "sd"}).value(),
            (ExportFormats{ExportFormat::kSd, ExportFormat::kNrrd}));
}

TEST(ExportFormat, AllIsMoreThanTheDefaultByTheSeries) {
  ExportFormats all = parse_formats({"all"}).value();
  EXPECT_EQ(all.size(), kAllExportFormats.size());
  EXPECT_EQ(all.erase(ExportFormat::kSeries), 1u);
  EXPECT_EQ(all, default_formats());
  EXPECT_EQ(parse_formats({}).value(), default_formats());
}

TEST(ExportFormat, AnotherWordIsNamedWithThoseThereAre) {
  for (const char* word : {"", "nifti", "NRRD", "sd ", "h5"}) {
    const auto formats = parse_formats({"sd", word});
    ASSERT_FALSE(formats) << word;
    EXPECT_EQ(formats.error().code, ErrorCode::kInvalidArgument);
    EXPECT_THAT(formats.error().message, HasSubstr("--formats: \"" + std::string(word) +
                                                   "\" is not a format: must be nifti-1007, "));
    EXPECT_THAT(formats.error().message, HasSubstr("series, or all"));
  }
}

}  // namespace
}  // namespace brainshift::client

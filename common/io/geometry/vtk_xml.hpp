// SPDX-License-Identifier: GPL-3.0-or-later
// VTK's XML container: arrays by name out of .vtu and .vtp files, whatever their encoding.
//
// ascii, binary (base64) and appended (raw or base64) arrays; zlib-compressed or not; header_type
// UInt32 or UInt64; either byte order. Source: VTK user's guide, "VTK XML file formats". Messages
// name the array and not the file.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/core/error.hpp"

namespace brainshift::io {

struct VtkArray {
  std::string name;
  std::string type;  // "Float32", "Int64", ...
  int components = 1;
  std::vector<double> reals;           // for Float32 and Float64
  std::vector<std::int64_t> integers;  // for all others

  bool is_real() const { return type == "Float32" || type == "Float64"; }
};

class VtkXmlFile {
 public:
  // `content` is the whole file; `grid` the data set type, e.g. "UnstructuredGrid". kUnreadable.
  static Result<VtkXmlFile> parse(std::string content, const std::string& grid);
  VtkXmlFile(VtkXmlFile&&) noexcept;
  ~VtkXmlFile();

  // The text of a string array of the field data; none without the array. kUnreadable for an array
  // that is no text, or of several texts.
  Result<std::optional<std::string>> field_text(const std::string& name) const;

  // An integer attribute of the piece, e.g. "NumberOfPoints"; 0 when absent, kUnreadable if no
  // count.
  Result<std::int64_t> count(const std::string& attribute) const;

  // Arrays of a section of the piece ("Points", "Cells", "PointData"), without decoding.
  std::vector<std::string> array_names(const std::string& section) const;
  bool is_real_array(const std::string& section, std::size_t index) const;

  // The index-th array of a section; `tuples` is the expected number, or -1 to take what the file
  // has (connectivity, whose length no attribute tells).
  Result<VtkArray> array(const std::string& section, std::size_t index, std::int64_t tuples) const;
  // By name.
  Result<VtkArray> array(const std::string& section, const std::string& name,
                         std::int64_t tuples) const;

 private:
  struct Impl;
  explicit VtkXmlFile(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace brainshift::io

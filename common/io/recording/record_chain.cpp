// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/recording/record_chain.hpp"

#include "common/io/files/binary_codec.hpp"
#include "common/io/files/checksum.hpp"

namespace brainshift::io {
namespace {

void append_text(std::string& out, std::string_view text) {
  append_number(out, static_cast<std::uint64_t>(text.size()));
  out.append(text);
}

std::uint32_t crc_of(std::string_view bytes, std::uint32_t before = 0) {
  return crc32_of(bytes.data(), bytes.size(), before);
}

std::uint32_t link(std::uint32_t previous, std::string_view kind, std::uint64_t sequence,
                   std::int64_t recorded_ns, std::string_view payload) {
  std::string head;
  append_number(head, previous);
  head.append(kind).push_back('\0');
  append_number(head, sequence);
  append_number(head, recorded_ns);
  append_number(head, static_cast<std::uint64_t>(payload.size()));
  return crc_of(payload, crc_of(head));
}

}  // namespace

std::uint32_t chain_start(const std::map<std::string, std::string>& meta) {
  std::string bytes;
  for (const auto& [key, value] : meta) {
    append_text(bytes, key);
    append_text(bytes, value);
  }
  return crc_of(bytes);
}

std::uint32_t chain_link(std::uint32_t previous, const SurgeryRecord& record) {
  return link(previous, to_string(record.kind), record.sequence, record.recorded_ns,
              record.payload);
}

std::uint32_t chain_end(std::uint32_t previous, std::uint64_t records) {
  return link(previous, "closed", records, 0, {});
}

std::uint32_t truth_checksum(std::int64_t observation_sequence, const SurgeryTruth& truth) {
  std::string bytes;
  append_number(bytes, observation_sequence);
  append_number(bytes, std::int64_t{truth.displacement.cols()});
  for (const auto& [kind, points] : truth.points) {
    for (const ScorePoint& point : points) {
      append_text(bytes, kind);
      for (int i = 0; i < 4; ++i) append_number(bytes, std::int64_t{point.nodes[i]});
      for (int i = 0; i < 4; ++i) append_number(bytes, point.weights[i]);
    }
  }
  for (const auto& [name, value] : truth.scalars) {
    append_text(bytes, name);
    append_number(bytes, value);
  }
  const auto* field = reinterpret_cast<const char*>(truth.displacement.data());
  const auto field_bytes = static_cast<std::size_t>(truth.displacement.size()) * sizeof(double);
  return crc_of({field, field_bytes}, crc_of(bytes));
}

}  // namespace brainshift::io

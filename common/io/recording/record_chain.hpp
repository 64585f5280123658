// SPDX-License-Identifier: GPL-3.0-or-later
// The checksum chain of a surgery file; private to it.
//
// Every record carries a CRC-32 (IEEE 802.3) over the CRC of the record before it and all that it
// holds itself. A record that was changed, lost, inserted or moved breaks the chain there, and the
// records in front of the break are still proved. The chain starts from the checksum of the meta
// table and ends, in a file that was closed, with a link over the number of records.
//
//   start  = CRC(key length, key, value length, value, ... in the order of keys)
//   link   = CRC(previous, kind, 0, sequence, recorded_ns, payload length, payload)
//   end    = link(previous, "closed", number of records, 0, "")
// Numbers are little-endian: CRCs of 4 bytes, all others of 8. It tells accidents, not forgery.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "common/io/recording/surgery_record.hpp"

namespace brainshift::io {

std::uint32_t chain_start(const std::map<std::string, std::string>& meta);
std::uint32_t chain_link(std::uint32_t previous, const SurgeryRecord& record);
std::uint32_t chain_end(std::uint32_t previous, std::uint64_t records);

// Truth is not part of the chain; each observation's truth has a checksum of its own.
std::uint32_t truth_checksum(std::int64_t observation_sequence, const SurgeryTruth& truth);

}  // namespace brainshift::io

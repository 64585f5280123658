// SPDX-License-Identifier: GPL-3.0-or-later
// DICOM files in explicit little endian, byte by byte after PS3.5 and PS3.10.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/temporary_folder.hpp"

namespace brainshift::io {

using Tag = std::pair<std::uint16_t, std::uint16_t>;

inline std::string even(std::string value, char filler = ' ') {
  if (value.size() % 2 != 0) value += filler;
  return value;
}
inline std::string us(std::uint16_t value) {
  std::string bytes;
  test_support::put(bytes, value);
  return bytes;
}

// Explicit little endian, element by element, written from the standard's PS3.5.
inline void put_element(std::string& out, Tag tag, const std::string& type,
                        const std::string& value) {
  test_support::put(out, tag.first), test_support::put(out, tag.second);
  out += type;
  if (type == "OW" || type == "OB" || type == "SQ") {
    test_support::put(out, std::uint16_t{0}),
        test_support::put(out, static_cast<std::uint32_t>(value.size()));
  } else {
    test_support::put(out, static_cast<std::uint16_t>(value.size()));
  }
  out += value;
}

// A sequence of items, each the bytes of its elements.
inline void put_sequence(std::string& out, Tag tag, const std::vector<std::string>& items) {
  std::string content;
  for (const std::string& item : items) {
    test_support::put(content, std::uint16_t{0xfffe}),
        test_support::put(content, std::uint16_t{0xe000});
    test_support::put(content, static_cast<std::uint32_t>(item.size()));
    content += item;
  }
  put_element(out, tag, "SQ", content);
}

// Preamble and the group of meta elements.
inline std::string file_head() {
  std::string meta, size, out(128, '\0');
  put_element(meta, {2, 0x0010}, "UI", even("1.2.840.10008.1.2.1", '\0'));
  test_support::put(size, static_cast<std::uint32_t>(meta.size()));
  out += "DICM";
  put_element(out, {2, 0}, "UL", size);
  return out + meta;
}

// A segmentation of "Tumour" (1) and "Oedema" (2).
struct FrameOf {
  int segment = 1;
  std::string place;             // along S, mm
  std::string beside = "-5\\7";  // across it, mm
};

// Axial frames of 3 columns and 5 rows, 15 bits each: the bits of a frame begin inside a byte.
struct Segmentation {
  std::vector<FrameOf> frames = {{2, "14"}, {1, "10"}, {2, "10"}};
  std::uint16_t bits = 1;
  std::string step = "2";
  std::string pixels;
  std::string bytes() const {
    std::string out = file_head(), shared, measures, orientation;
    put_element(out, {0x0008, 0x0016}, "UI", even("1.2.840.10008.5.1.4.1.1.66.4", '\0'));
    put_element(out, {0x0028, 0x0002}, "US", us(1));
    put_element(out, {0x0028, 0x0008}, "IS", even(std::to_string(frames.size())));
    put_element(out, {0x0028, 0x0010}, "US", us(5));
    put_element(out, {0x0028, 0x0011}, "US", us(3));
    put_element(out, {0x0028, 0x0100}, "US", us(bits));
    std::vector<std::string> listed;
    for (const auto& [number, name] : {std::pair{1, "Tumour"}, {2, "Oedema"}}) {
      std::string& item = listed.emplace_back();
      put_element(item, {0x0062, 0x0004}, "US", us(static_cast<std::uint16_t>(number)));
      put_element(item, {0x0062, 0x0005}, "LO", even(name));
    }
    put_sequence(out, {0x0062, 0x0002}, listed);
    if (bits == 8) put_element(out, {0x0062, 0x000e}, "US", us(100));
    put_element(measures, {0x0018, 0x0050}, "DS", even(step));
    put_element(measures, {0x0028, 0x0030}, "DS", even("1\\0.5"));
    put_element(orientation, {0x0020, 0x0037}, "DS", even("1\\0\\0\\0\\1\\0"));
    put_sequence(shared, {0x0020, 0x9116}, {orientation});
    put_sequence(shared, {0x0028, 0x9110}, {measures});
    put_sequence(out, {0x5200, 0x9229}, {shared});
    std::vector<std::string> own;
    for (const FrameOf& frame : frames) {
      std::string place, segment, &item = own.emplace_back();
      put_element(place, {0x0020, 0x0032}, "DS", even(frame.beside + "\\" + frame.place));
      put_element(segment, {0x0062, 0x000b}, "US", us(static_cast<std::uint16_t>(frame.segment)));
      put_sequence(item, {0x0020, 0x9113}, {place});
      put_sequence(item, {0x0062, 0x000a}, {segment});
    }
    put_sequence(out, {0x5200, 0x9230}, own);
    put_element(out, {0x7fe0, 0x0010}, "OB", pixels);
    return out;
  }
  // Pixel p of frame f is set.
  Segmentation& set(std::size_t frame, std::size_t pixel, char value = 1) {
    const std::size_t all = 15 * frames.size(), at = 15 * frame + pixel;
    pixels.resize(bits == 8 ? all + all % 2 : 6, '\0');
    if (bits == 8) {
      pixels[at] = value;
    } else {
      pixels[at / 8] = static_cast<char>(pixels[at / 8] | (1 << (at % 8)));
    }
    return *this;
  }
};

}  // namespace brainshift::io

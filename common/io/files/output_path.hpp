// SPDX-License-Identifier: GPL-3.0-or-later
// Paths that a program will write to, checked before its work begins.
//
// A file is put in place by renaming (file_access.hpp), which would replace a device, a named pipe
// or a socket of that name. Messages are "OPTION: PATH: reason"; `option` is as the user typed it,
// e.g. "--out".
#pragma once

#include <filesystem>
#include <string_view>

#include "common/core/error.hpp"

namespace brainshift::io {

// Ok if a file can be written at `path`: nothing is there, or a regular file (a link is followed),
// and its folder takes new files, which is tried with a temporary one. kInvalidArgument, or
// kNotFound for the folder.
Status check_output_file(std::string_view option, const std::filesystem::path& path);

// Ok if `path` is a folder that takes new files, or can become one; makes nothing.
// kInvalidArgument.
Status check_output_folder(std::string_view option, const std::filesystem::path& path);

}  // namespace brainshift::io

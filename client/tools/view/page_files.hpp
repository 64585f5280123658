// SPDX-License-Identifier: GPL-3.0-or-later
// The page that browsers get: page.html, page.css, page.js and surface.js, compiled in
// (CMakeLists.txt).
#pragma once

#include <string_view>

namespace brainshift::client {

extern const std::string_view kPageHtml;
extern const std::string_view kPageStyle;
extern const std::string_view kPageScript;
extern const std::string_view kSurfaceScript;

}  // namespace brainshift::client

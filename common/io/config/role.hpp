// SPDX-License-Identifier: GPL-3.0-or-later
// Role: what the holder of a key may ask of the daemon. Each role may do all that the one before it
// may.
//
//   viewer   look: status, model, subscription
//   source   observe: hand in observations
//   owner    start sessions
//   admin    take over a session of somebody else; everything else that a request may ask
//
// Without keys every peer is an admin (docs/security.md).
#pragma once

#include <array>
#include <optional>
#include <string_view>

namespace brainshift {

enum class Role { kViewer, kSource, kOwner, kAdmin };

inline constexpr std::array kAllRoles = {Role::kViewer, Role::kSource, Role::kOwner, Role::kAdmin};

// Stable lower-case words, used in allow-lists and on the command line.
constexpr std::string_view to_string(Role role) {
  switch (role) {
    case Role::kViewer: return "viewer";
    case Role::kSource: return "source";
    case Role::kOwner: return "owner";
    case Role::kAdmin: return "admin";
  }
  return "viewer";
}

constexpr std::optional<Role> role_from(std::string_view word) {
  for (const Role role : kAllRoles) {
    if (to_string(role) == word) return role;
  }
  return std::nullopt;
}

// Whether `role` may do what needs the role `least`.
constexpr bool includes(Role role, Role least) { return role >= least; }

}  // namespace brainshift

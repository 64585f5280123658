// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/config/role.hpp"

namespace brainshift {

std::string_view to_string(Role role) {
  switch (role) {
    case Role::kViewer: return "viewer";
    case Role::kSource: return "source";
    case Role::kOwner: return "owner";
    case Role::kAdmin: return "admin";
  }
  return "viewer";
}

std::optional<Role> role_from(std::string_view word) {
  for (const Role role : kAllRoles) {
    if (to_string(role) == word) return role;
  }
  return std::nullopt;
}

}  // namespace brainshift

// SPDX-License-Identifier: Apache-2.0
// The one header that a navigation system includes: `#include <brainshift/client.hpp>`.
#pragma once

#include "client/lib/client.hpp"
#include "client/lib/client_keys.hpp"
#include "client/lib/field.hpp"
#include "client/lib/field_status.hpp"

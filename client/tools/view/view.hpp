// SPDX-License-Identifier: GPL-3.0-or-later
// `brainshift view`: a client of the daemon that shows its field to browsers of this computer, and
// changes nothing.
//
// It takes its word from the field status (client/lib/field_status.hpp) and publishes it several
// times a second. A page that hears nothing for 700 ms, or whose events wait on the way, goes grey
// by itself.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "client/lib/client_keys.hpp"
#include "client/tools/bridge/socket.hpp"
#include "common/core/error.hpp"

namespace brainshift::client {

struct ViewOptions {
  std::string endpoint = "tcp://127.0.0.1:5555";
  Address listen{"127.0.0.1", 8080};
  // Whose MRI is drawn; empty: the field is drawn on the brain's outline.
  std::filesystem::path model;
  // The daemon's journal_dir, for advice on what to measure next (page_advice.hpp); empty: none.
  // Needs `model`.
  std::filesystem::path journal;
  std::optional<ClientKeys> keys = std::nullopt;
};

// Until `stopped`, which is asked several times a second. Waits for a daemon that is not there, or
// has no model yet.
// tell: sentences for people; the first names the page's address.
// Errors: of the address (HttpServer::listen), of reading the model file and its MRI;
// kInvalidArgument: the first model that the daemon serves is not that of the file, or a journal
// without a model; kNotFound: the journal is no folder.
Status view(const ViewOptions& options, const std::function<bool()>& stopped,
            const std::function<void(const std::string&)>& tell);

}  // namespace brainshift::client

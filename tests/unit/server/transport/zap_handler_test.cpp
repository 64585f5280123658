// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/transport/zap_handler.hpp"

#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <string>
#include <vector>

namespace brainshift::server {
namespace {

using Parts = std::vector<std::string>;

constexpr const char* kText = "rq:rM>}U?@Lns47E1%kR.o@n%FcmmsL/@{H8]yf7";  // of the RFC of CURVE

std::string bytes_of(const char* text) {
  std::string bytes(32, '\0');
  EXPECT_NE(zmq_z85_decode(reinterpret_cast<std::uint8_t*>(bytes.data()), text), nullptr);
  return bytes;
}

Parts request(const std::string& mechanism, const std::string& key) {
  return {"1.0", "7", "brainshiftd", "", "", mechanism, key};
}

class ZapHandlerTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { spdlog::set_level(spdlog::level::off); }

  Parts ask(const Parts& parts) {
    zmq::socket_t socket(context_, zmq::socket_type::req);
    socket.set(zmq::sockopt::linger, 0);
    socket.set(zmq::sockopt::rcvtimeo, 10'000);
    socket.connect("inproc://zeromq.zap.01");
    for (std::size_t i = 0; i < parts.size(); ++i) {
      socket.send(zmq::buffer(parts[i]),
                  i + 1 < parts.size() ? zmq::send_flags::sndmore : zmq::send_flags::none);
    }
    Parts reply;
    zmq::message_t part;
    do {
      if (!socket.recv(part)) return reply;
      reply.push_back(part.to_string());
    } while (part.more());
    return reply;
  }

  zmq::context_t context_;
};

TEST_F(ZapHandlerTest, AKnownKeyIsAdmittedUnderItsName) {
  const ZapHandler handler(context_, {{kText, "console"}});
  EXPECT_EQ(ask(request("CURVE", bytes_of(kText))),
            (Parts{"1.0", "7", "200", "OK", "console", ""}));
  EXPECT_EQ(handler.refused(), 0u);
}

TEST_F(ZapHandlerTest, EverythingElseIsRefused) {
  const ZapHandler handler(context_, {{kText, "console"}});
  std::string other = bytes_of(kText);
  other[31] = static_cast<char>(other[31] ^ 1);
  Parts old = request("CURVE", bytes_of(kText));
  old[0] = "0.9";
  Parts longer = request("CURVE", bytes_of(kText));
  longer.push_back("more");
  const std::vector<Parts> strangers = {request("CURVE", other),
                                        request("CURVE", ""),
                                        request("CURVE", std::string(33, 'x')),
                                        request("NULL", bytes_of(kText)),
                                        request("PLAIN", bytes_of(kText)),
                                        old,
                                        longer};
  for (const Parts& stranger : strangers) {
    const Parts reply = ask(stranger);
    ASSERT_EQ(reply.size(), 6u);
    EXPECT_EQ(reply[2], "400");
    EXPECT_EQ(reply[4], "");
  }
  EXPECT_EQ(handler.refused(), strangers.size());
}

TEST_F(ZapHandlerTest, OneAfterAnotherInOneContext) {
  for (int i = 0; i < 3; ++i) {
    const ZapHandler handler(context_, {{kText, "console"}});
    EXPECT_EQ(ask(request("CURVE", bytes_of(kText))).at(2), "200");
  }
  const ZapHandler first(context_, {});
  EXPECT_THROW(ZapHandler(context_, {}), zmq::error_t);
}

}  // namespace
}  // namespace brainshift::server

// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "link/udpm_url.hpp"

#include <catch2/catch.hpp>

namespace tessera {
namespace {

TEST_CASE("UdpmUrl: a full URL") {
  const Outcome<UdpmUrl> url = UdpmUrl::parse("udpm://239.255.76.67:7667?ttl=0&recv_buf_size=2048");
  REQUIRE(url.ok());
  CHECK(address_text(url->group) == "239.255.76.67");
  CHECK(url->port == 7667);
  CHECK(url->ttl == 0);
  CHECK(url->receive_buffer_bytes == 2048);
  CHECK(UdpmUrl::parse(kDefaultUrl).ok());
  CHECK(UdpmUrl::parse("udpm://224.0.0.0:1?ttl=255")->ttl == 255);
  CHECK(UdpmUrl::parse("udpm://239.255.255.255:65535?ttl=1")->port == 65535);
}

TEST_CASE("UdpmUrl: a refusal is one line, whatever the URL") {
  const Outcome<UdpmUrl> url = UdpmUrl::parse("udpm://239.255.76.67:7667\n?ttl=0\x1b");
  REQUIRE_FALSE(url.ok());
  CHECK(url.failure().text().starts_with(
      "cannot use the LCM URL udpm://239.255.76.67:7667 ?ttl=0 : its port"));
}

TEST_CASE("UdpmUrl: what is not full, or not sane, is refused with the URL and an example") {
  for (const char* const text : {"",
                                 "udpm://",
                                 "memq://",
                                 "udpm://239.255.76.67:7667",
                                 "udpm://239.255.76.67:7667?",
                                 "udpm://239.255.76.67?ttl=0",
                                 "udpm://:7667?ttl=0",
                                 "udpm://239.255.76.67:0?ttl=0",
                                 "udpm://239.255.76.67:65536?ttl=0",
                                 "udpm://239.255.76.67:7667?ttl=256",
                                 "udpm://239.255.76.67:7667?ttl=-1",
                                 "udpm://239.255.76.67:7667?ttl=",
                                 "udpm://239.255.76.67:7667?ttl=0&ttl=0",
                                 "udpm://192.168.0.1:7667?ttl=0",
                                 "udpm://240.0.0.1:7667?ttl=0",
                                 "udpm://223.255.255.255:7667?ttl=0",
                                 "udpm://239.255.76:7667?ttl=0",
                                 "udpm://239.255.76.67.1:7667?ttl=0",
                                 "udpm://239.255.76.256:7667?ttl=0",
                                 "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=1407",
                                 "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=1073741825",
                                 "udpm://239.255.76.67:7667?ttl=0&speed=9",
                                 "udpm://239.255.76.67:7667 ?ttl=0"}) {
    INFO(text);
    const Outcome<UdpmUrl> url = UdpmUrl::parse(text);
    REQUIRE_FALSE(url.ok());
    CHECK(url.failure().kind == FailureKind::kUsage);
    CHECK(url.failure().text().find(kDefaultUrl) != std::string::npos);
  }
}

}  // namespace
}  // namespace tessera

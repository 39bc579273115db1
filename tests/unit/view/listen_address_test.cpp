// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "view/listen_address.hpp"

#include <catch2/catch.hpp>

using namespace tessera;

TEST_CASE("parse_listen_address: an address of numbers and a port, of this machine or of all") {
  struct Case {
    const char* text;
    const char* url;
    bool loopback;
  };
  for (const Case& c : {Case{"127.0.0.1:8080", "http://127.0.0.1:8080/", true},
                        Case{"127.200.3.4:1", "http://127.200.3.4:1/", true},
                        Case{"localhost:65535", "http://127.0.0.1:65535/", true},
                        Case{"LocalHost:0", "http://127.0.0.1:0/", true},
                        Case{"[::1]:8080", "http://[::1]:8080/", true},
                        Case{"0.0.0.0:8080", "http://0.0.0.0:8080/", false},
                        Case{"[::]:8080", "http://[::]:8080/", false},
                        Case{"128.0.0.1:8080", "http://128.0.0.1:8080/", false},
                        Case{"[::ffff:127.0.0.1]:80", "http://[::ffff:127.0.0.1]:80/", false}}) {
    INFO(c.text);
    const Outcome<ListenAddress> address = parse_listen_address(c.text);
    REQUIRE(address.ok());
    CHECK(address->url(address->port) == c.url);
    CHECK(address->is_loopback() == c.loopback);
  }
}

TEST_CASE("parse_listen_address: what is none is refused in one line that says what to give") {
  for (const char* text : {"",
                           ":",
                           "8080",
                           ":8080",
                           "127.0.0.1",
                           "127.0.0.1:",
                           "127.0.0.1:65536",
                           "127.0.0.1:-1",
                           "127.0.0.1:+1",
                           "127.0.0.1:80 ",
                           " 127.0.0.1:80",
                           "127.1:80",
                           "0x7f000001:80",
                           "example.org:80",
                           "localhost",
                           "::1:80",
                           "[::1]",
                           "[::1]80",
                           "[127.0.0.1]:80",
                           "[::1:80",
                           "[localhost]:80",
                           "127.0.0.1:80:80",
                           "127.0.0.1\n:80"}) {
    INFO(text);
    const Outcome<ListenAddress> address = parse_listen_address(text);
    REQUIRE_FALSE(address.ok());
    CHECK(address.failure().text().find("127.0.0.1:8080") != std::string::npos);
    CHECK(address.failure().text().find('\n') == std::string::npos);
  }
}

TEST_CASE("is_trusted_host: numbers and localhost, with any port, and no other name") {
  for (const char* host : {"127.0.0.1", "127.0.0.1:8080", "localhost", "LOCALHOST:1", "[::1]",
                           "[::1]:8080", "10.0.0.7:9"})
    CHECK(is_trusted_host(host));
  for (const char* host :
       {"", "evil.example", "localhost.", "localhost.evil.example", "127.0.0.1.nip.example",
        "127.0.0.1:", "127.0.0.1:x", "127.1", "2130706433", "0x7f.1", "[::1", "::1",
        "user@127.0.0.1", "127.0.0.1/evil.example", "[fe80::1%eth0]"}) {
    INFO(host);
    CHECK_FALSE(is_trusted_host(host));
  }
}

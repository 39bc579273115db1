// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// One robot of a team. Reads lines from standard input: "report" prints what it holds as one line
// of JSON, "quit" or the end of input ends it without a word to the others; SIGTERM lets it take
// its leave and report first.
#include <poll.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>

#include "processes/member.hpp"

namespace {

volatile std::sig_atomic_t is_told_to_leave = 0;

/// Lines of standard input, as far as they have come.
class Orders {
 public:
  /// Calls obey for each; false iff there will be no more.
  template <class Obey>
  bool hear(Obey&& obey) {
    pollfd input{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0};
    while (::poll(&input, 1, 0) > 0) {
      char text[256];
      const ssize_t size = ::read(STDIN_FILENO, text, sizeof text);
      if (size <= 0) return false;
      waiting_.append(text, static_cast<std::size_t>(size));
    }
    for (std::size_t end; (end = waiting_.find('\n')) != std::string::npos;) {
      const std::string line = waiting_.substr(0, end);
      waiting_.erase(0, end + 1);
      if (line == "quit") return false;
      obey(line);
    }
    return true;
  }

 private:
  std::string waiting_;
};

void print(const std::string& line) {
  std::puts(line.c_str());
  std::fflush(stdout);
}

void run(const tessera::processes::MemberConfig& config) {
  tessera::processes::Member member(config);
  Orders orders;
  print("ready");
  const auto obey = [&](const std::string& order) {
    if (order != "report") throw std::runtime_error("say report or quit, not " + order);
    print(member.report());
  };
  while (is_told_to_leave == 0) {
    if (!orders.hear(obey)) return;
    member.step();
  }
  member.leave();
  print(member.report());
}

}  // namespace

int main(int argc, char** argv) {
  tessera::processes::MemberConfig config;
  CLI::App app("One robot of a team, for tests");
  app.add_option("--robot", config.robot)->required();
  app.add_option("--session", config.session, "its epoch, too");
  app.add_option("--interface", config.link.interface)->required();
  app.add_option("--url", config.link.url);
  app.add_option("--key", config.keys.fleet_key, "a fleet key's file");
  app.add_option("--secret", config.keys.robot_secret, "this robot's, in a fleet that signs");
  app.add_option("--public-keys", config.keys.robot_public_keys, "of the whole fleet");
  app.add_option("--mission", config.keys.mission, "instead of the one that the key's file names");
  app.add_option("--map", config.map, "publish the blocks of this map instead of random ones");
  app.add_option("--seed", config.seed);
  app.add_option("--blocks", config.blocks, "in all, at most");
  app.add_option("--blocks-per-s", config.blocks_per_s);
  app.add_option("--resolution", config.resolution_m, "metres, without a map");
  app.add_option("--parts", config.parts, "places for blocks of all robots");
  app.add_option("--robot-parts", config.robot_parts, "of these, those of one robot; 0: all");
  app.add_option("--floor", config.floor, "its lowest epoch that counts");
  CLI11_PARSE(app, argc, argv);
  std::signal(SIGTERM, [](int) { is_told_to_leave = 1; });
  try {
    run(config);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "team_member: %s\n", error.what());
    return 1;
  }
}

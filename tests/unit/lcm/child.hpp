// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Another program, run by a test.
#pragma once

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <string>
#include <vector>

#include "unit/lcm/own_network.hpp"

namespace tessera {

/// A program of LCM's that the test started, and ends.
class Child {
 public:
  explicit Child(std::vector<std::string> words) {
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    posix_spawn_file_actions_t quiet;
    ::posix_spawn_file_actions_init(&quiet);
    for (const int stream : {0, 1, 2})
      ::posix_spawn_file_actions_addopen(&quiet, stream, "/dev/null", O_RDWR, 0);
    if (::posix_spawnp(&process_, arguments[0], &quiet, nullptr, arguments.data(), environ) != 0)
      process_ = -1;
    ::posix_spawn_file_actions_destroy(&quiet);
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  ~Child() {
    if (is_running()) {
      ::kill(process_, SIGKILL);
      ::waitpid(process_, nullptr, 0);
    }
  }
  [[nodiscard]] bool is_running() {
    if (process_ > 0 && ::waitpid(process_, &status_, WNOHANG) == process_) process_ = -1;
    return process_ > 0;
  }
  [[nodiscard]] bool end(int signal) {
    if (is_running()) ::kill(process_, signal);
    return eventually([this] { return !is_running(); });
  }

 private:
  pid_t process_ = -1;
  int status_ = 0;
};

}  // namespace tessera

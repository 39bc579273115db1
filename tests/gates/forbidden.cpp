// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// One of each thing that the core must not use, for the gates to refuse. It is compiled and never
// run.
#include <pthread.h>
#include <sys/socket.h>

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>
#include <typeinfo>
#include <vector>

namespace tessera::forbidden {

struct Shape {
  virtual ~Shape() = default;
  virtual int corners() const { return 0; }
};
struct Square : Shape {
  int corners() const override { return 4; }
};

int read_environment();

int exceptions(const std::vector<int>& values, unsigned index) {
  const std::string name(index, 'n');  // to be destroyed on the way out of the throw
  if (read_environment() > 0) throw read_environment();
  return values.at(index) + static_cast<int>(name.size());
}

int guarded_static() {
  static const int value = read_environment();
  return value;
}

const std::type_info& rtti(const Shape& shape) { return typeid(shape); }

Shape* operator_new() { return new Square; }

void* heap_of_c(std::size_t bytes) { return std::malloc(bytes); }

std::int64_t clocks() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_nsec;
}

void input_and_output(int value) {
  std::FILE* const file = std::fopen("x", "w");
  std::printf("%d %p", value, static_cast<void*>(file));
}

int threads(pthread_t& thread, void* (*body)(void*)) {
  return pthread_create(&thread, nullptr, body, nullptr) + socket(AF_INET, SOCK_DGRAM, 0);
}

void leave() { std::abort(); }

}  // namespace tessera::forbidden

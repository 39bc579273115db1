// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A Result has a value or a reason; every status has its phrase.
#include "tessera/base/status.hpp"

#include <catch2/catch.hpp>
#include <memory>
#include <set>
#include <string>

namespace tessera {
namespace {

constexpr Result<int> half(int value) {
  if (value % 2 != 0) return Status::kInvalidArgument;
  return value / 2;
}
static_assert(half(6).ok() && *half(6) == 3);
static_assert(!half(7).ok() && half(7).status() == Status::kInvalidArgument);

TEST_CASE("Result: with a value is ok") {
  const Result<int> result = 5;
  CHECK(result.ok());
  CHECK(result.status() == Status::kOk);
  CHECK(*result == 5);
}

TEST_CASE("Result: with a status tells the reason") {
  const Result<int> result = Status::kTruncated;
  CHECK_FALSE(result.ok());
  CHECK(result.status() == Status::kTruncated);
}

TEST_CASE("Result: the value can be changed and reached into") {
  struct Pair {
    int first = 0;
    int second = 0;
  };
  Result<Pair> result = Pair{1, 2};
  result->second = 3;
  (*result).first = 4;
  CHECK(result->first == 4);
  CHECK(result->second == 3);
}

TEST_CASE("Result: carries a value that can only be moved") {
  Result<std::unique_ptr<int>> result = std::make_unique<int>(8);
  const std::unique_ptr<int> taken = std::move(*result);
  CHECK(*taken == 8);
}

TEST_CASE("to_string: every status has a phrase of its own") {
  std::set<std::string> phrases;
  for (const Status status : {Status::kOk, Status::kInvalidArgument, Status::kResourceExhausted,
                              Status::kOutOfRange, Status::kMismatch, Status::kCorrupt,
                              Status::kTruncated, Status::kUnsupported, Status::kIo}) {
    phrases.insert(to_string(status));
  }
  CHECK(phrases.size() == 9);
  CHECK(phrases.count("unknown status") == 0);
}

TEST_CASE("to_string: a number that is no status says so") {
  CHECK(std::string(to_string(static_cast<Status>(200))) == "unknown status");
}

}  // namespace
}  // namespace tessera

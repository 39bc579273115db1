// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "base/system_failure.hpp"

#include <cerrno>
#include <string>
#include <system_error>

namespace tessera {
namespace {

const char* remedy_for(int error) {
  switch (error) {
    case ENOENT:
      return "check the name, and that its folder exists";
    case ENOTDIR:
      return "a part of the path is not a folder; check the name";
    case EISDIR:
      return "it is a folder; name a file in it";
    case EACCES:
    case EPERM:
      return "check the permissions of the file and of its folder";
    case EROFS:
      return "the disk is mounted read-only; choose another place";
    case ENOSPC:
    case EDQUOT:
      return "free some space or choose another disk";
    case EFBIG:
      return "the size limit is reached (see ulimit -f); raise it or write less";
    case ENAMETOOLONG:
      return "choose a shorter path";
    case ELOOP:
      return "its symbolic links form a circle; fix them";
    case EMFILE:
    case ENFILE:
      return "too many files are open; raise the limit (see ulimit -n)";
    default:
      return "check the disk, then try again";
  }
}

}  // namespace

Failure system_failure(std::string_view verb, std::string_view path, int error, FailureKind kind) {
  std::string message = "cannot ";
  message.append(verb).append(" ").append(path).append(": ");
  message.append(std::generic_category().message(error)).append("; ").append(remedy_for(error));
  return {std::move(message), kind};
}

}  // namespace tessera

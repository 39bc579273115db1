// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A subcommand: a function that declares its options and sets a callback, which sets the exit
// status.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "base/outcome.hpp"

namespace tessera {

/// 0 done, 1 bad input or usage, 2 the work could not be completed.
inline constexpr int kExitDone = 0;
inline constexpr int kExitUsage = 1;
inline constexpr int kExitFailure = 2;

/// Prints one line on stderr and returns the matching exit status.
int fail(const Failure& failure);
/// Prints "warning: ..." on stderr.
void warn(const Message& message);

void add_map_command(CLI::App& app, int& exit_status);
void add_fuse_command(CLI::App& app, int& exit_status);
void add_align_command(CLI::App& app, int& exit_status);
void add_eval_command(CLI::App& app, int& exit_status);
void add_fit_kernels_command(CLI::App& app, int& exit_status);
void add_query_command(CLI::App& app, int& exit_status);
void add_export_command(CLI::App& app, int& exit_status);
void add_info_command(CLI::App& app, int& exit_status);
void add_convert_command(CLI::App& app, int& exit_status);
void add_simulate_command(CLI::App& app, int& exit_status);
void add_node_command(CLI::App& app, int& exit_status);
void add_play_command(CLI::App& app, int& exit_status);
void add_doctor_command(CLI::App& app, int& exit_status);
void add_key_command(CLI::App& app, int& exit_status);
void add_pages_command(CLI::App& app, int& exit_status);
void add_view_command(CLI::App& app, int& exit_status);

}  // namespace tessera

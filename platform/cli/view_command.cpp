// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// tessera view: shows maps in a browser.
#include <signal.h>

#include <atomic>
#include <cstdio>
#include <filesystem>

#include "base/number_text.hpp"
#include "cli/command.hpp"
#include "cli/setting_options.hpp"
#include "cli/view_maps.hpp"
#include "view/viewer.hpp"

namespace tessera {

namespace {

struct ViewOptions {
  std::vector<std::string> maps;
  std::vector<std::string> sessions;
  std::vector<std::string> transforms;
  std::string listen = "127.0.0.1:8080";
  bool everywhere = false;
};

constexpr Setting kViewRows[] = {
    row<&ViewOptions::listen>(
        {"--listen"},
        "IP address and port to serve at, [::1]:8080 for IPv6; port 0 chooses a free one",
        {.value = "ADDRESS:PORT"}),
    row<&ViewOptions::everywhere>(
        {"--everywhere"}, "Allow an address that other machines reach; they can then see the maps",
        {.flag = true}),
};
constexpr SettingTable<ViewOptions> kViewSettings{kViewRows};

std::atomic<bool> stop_asked{false};

void stop_by_signal() {
  struct sigaction action {};
  action.sa_handler = [](int) { stop_asked.store(true, std::memory_order_relaxed); };
  ::sigemptyset(&action.sa_mask);
  for (const int signal : {SIGTERM, SIGINT}) ::sigaction(signal, &action, nullptr);
  ::signal(SIGPIPE, SIG_IGN);
}

Outcome<ListenAddress> address_of(const ViewOptions& options) {
  Outcome<ListenAddress> address = parse_listen_address(options.listen);
  if (!address.ok()) return Failure{"--listen " + address.failure().message};
  if (!address->is_loopback() && !options.everywhere) {
    return Failure{
        "--listen " + options.listen +
        " is open to everybody who reaches this machine; add --everywhere to allow that, "
        "or give 127.0.0.1:8080"};
  }
  return address;
}

Outcome<void> run_view(const ViewOptions& options) {
  TESSERA_TRY_ASSIGN(const ListenAddress address, address_of(options));
  TESSERA_TRY_ASSIGN(const ViewedMaps viewed,
                     load_viewed_maps(options.maps, options.sessions, options.transforms));
  stop_by_signal();
  TESSERA_TRY_ASSIGN(const std::unique_ptr<Viewer> viewer,
                     Viewer::open({.address = address}, view_maps_of(viewed), [] {
                       return Json{{"live", false}};
                     }));
  if (!address.is_loopback())
    warn("everybody who reaches this machine can see these maps; nothing is encrypted");
  std::printf("%s shows %s; Ctrl+C ends it\n", viewer->url().c_str(),
              counted(options.maps.size(), "map").c_str());
  std::fflush(stdout);
  constexpr int kTurn_ms = 100;
  while (!stop_asked.load(std::memory_order_relaxed)) viewer->serve(kTurn_ms);
  return {};
}

}  // namespace

void add_view_command(CLI::App& app, int& exit_status) {
  CLI::App* const command =
      app.add_subcommand("view", "Show maps in a browser, served by this command");
  auto o = std::make_shared<ViewOptions>();
  command
      ->add_option("MAPS", o->maps,
                   "Map files; local maps given with a global one show who contributed to it")
      ->required()
      ->expected(1, kMostViewedMaps)
      ->type_name("MAP.tsm");
  declare_settings(*command, kViewSettings, *o);
  command
      ->add_option("--session", o->sessions,
                   "A map of an earlier day that the global map was made of too, as given to fuse")
      ->allow_extra_args(false)
      ->type_name("MAP.tsm[:WEIGHT]");
  command
      ->add_option(
          "--transform", o->transforms,
          "4x4 matrix T_global_map of a map or session that a global one was made of, as for fuse "
          "[stored in the map, else the identity]")
      ->allow_extra_args(false)
      ->type_name("MAP.tsm=T.txt");
  command->footer("Example: tessera view global.tsm robot_0.tsm robot_1.tsm");
  command->callback([o, &exit_status] {
    const Outcome<void> outcome = run_view(*o);
    if (!outcome.ok()) exit_status = fail(outcome.failure());
  });
}

}  // namespace tessera

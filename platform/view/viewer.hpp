// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Serves the page: its files, the list of maps, changes in them, one voxel, and the status.
// docs/reference/view.md describes it. Stores nothing about a page between two requests.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tessera/base/counters.hpp"
#include "view/view_map.hpp"
#include "view/web_server.hpp"

namespace tessera {

struct ViewerConfig {
  ListenAddress address;
  std::uint32_t voxels_per_s = 0;  ///< For all pages together; 0: no limit.
};

#define TESSERA_VIEWER_COUNTERS(ROW)                                                             \
  ROW(COUNTER, uint64_t, messages, "Messages of changed blocks.")                                \
  ROW(COUNTER, uint64_t, blocks, "Blocks in them.")                                              \
  ROW(COUNTER, uint64_t, bytes, "Bytes of these messages.")                                      \
  ROW(COUNTER, uint64_t, deferred,                                                               \
      "Messages that were cut short or empty, as the budget of a second was used up or a block " \
      "was changed during every try: the rest is sent later.")

struct ViewerReport {
  TESSERA_VIEWER_COUNTERS(TESSERA_COUNTER_MEMBER)
  WebServerReport web{};
};
TESSERA_COUNTER_TABLE(ViewerReport, TESSERA_VIEWER_COUNTERS(TESSERA_COUNTER_ROW))

/// For one thread at a time, except report().
class Viewer {
 public:
  /// The status for the page's panels and tracks: docs/reference/view.md, /status.
  using Status = std::function<Json()>;

  /// Starts to listen. maps: at most 64. Fails as WebServer::open.
  static Outcome<std::unique_ptr<Viewer>> open(const ViewerConfig& config,
                                               std::vector<std::unique_ptr<ViewMap>> maps,
                                               Status status);
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;
  ~Viewer() = default;

  /// URL for a browser.
  [[nodiscard]] std::string url() const { return address_.url(server_->port()); }
  /// As WebServer::serve.
  void serve(int timeout_ms) noexcept;
  /// For any thread.
  [[nodiscard]] ViewerReport report() const noexcept { return shared_report_.load(); }

 private:
  Viewer(const ViewerConfig& config, std::vector<std::unique_ptr<ViewMap>> maps, Status status);
  [[nodiscard]] WebReply answer(WebRequest& request);
  [[nodiscard]] WebReply maps_reply() const;
  [[nodiscard]] WebReply status_reply() const;
  [[nodiscard]] WebReply blocks_reply(WebRequest& request);
  [[nodiscard]] WebReply keys_reply(WebRequest& request);
  [[nodiscard]] WebReply voxel_reply(WebRequest& request);
  [[nodiscard]] ViewMap* map_of(const WebRequest& request) const;

  ListenAddress address_;
  std::vector<std::unique_ptr<ViewMap>> maps_;
  Status status_;
  ViewBudget budget_;
  std::uint64_t session_;
  ViewerReport report_{};
  SharedReport<ViewerReport> shared_report_;
  std::unique_ptr<WebServer> server_;
};

}  // namespace tessera

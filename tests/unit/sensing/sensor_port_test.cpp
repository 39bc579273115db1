// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Sensors over a real LCM network: from the real library and from our player's sender, recorded and
// played by LCM's programs, with lies in between.
#include "scans/sensor_port.hpp"

#include <lcm/lcm.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <utility>
#include <vector>

#include "base/allocation_counter.hpp"
#include "base/monotonic_clock.hpp"
#include "link/sensor_sender.hpp"
#include "unit/lcm/child.hpp"
#include "unit/lcm/own_network.hpp"
#include "unit/sensing/port_bench.hpp"

namespace tessera {
namespace {

TEST_CASE("SensorPort: a sweep of 2 MB and its poses arrive whole, number by number") {
  if (!enter_own_network()) return;
  const auto port = open_port(port_config());
  const auto sender = open_sender();
  const SampleSweep sweep(120'000, 1);
  const std::int64_t now_us = port->stamp_now_us();
  REQUIRE(port->start().ok());
  REQUIRE(sender->send("TESSERA_POSE", pose_message(now_us - 2'000, 1)));
  REQUIRE(sender->send("TESSERA_SEMANTIC_CLOUD", sweep.message(now_us)));
  REQUIRE(sender->send("TESSERA_POSE", pose_message(now_us + 1, 4)));
  REQUIRE(eventually([&] { return port->front() != nullptr; }));
  Scan& slot = *port->front();
  CHECK(slot.stamp_us == now_us);
  CHECK(slot.T_map_sensor(0, 3) == 1.0);
  CHECK(slot.poses().size() == 2);
  CHECK(sweep.is_in(slot));
  port->pop();
  CHECK(port->front() == nullptr);
  REQUIRE(eventually([&] { return port->report().match.given == 1; }));
  const SensorReport report = port->report();
  CHECK(report.link.fragments.messages == 1);
  CHECK(report.pose_gaps == 2);
  CHECK(report.link.kernel_dropped == 0);
}

TEST_CASE("SensorPort: hears what liblcm publishes, long and short") {
  if (!enter_own_network()) return;
  const auto port = open_port(port_config());
  const std::unique_ptr<lcm_t, void (*)(lcm_t*)> lcm(lcm_create(kDefaultSensorUrl), &lcm_destroy);
  REQUIRE(lcm != nullptr);
  const std::int64_t now_us = port->stamp_now_us();
  const auto publish = [&](const char* channel, const std::vector<std::byte>& message) {
    REQUIRE(lcm_publish(lcm.get(), channel, message.data(),
                        static_cast<unsigned>(message.size())) == 0);
  };
  publish("TESSERA_POSE", pose_message(now_us - 10'000, 1));
  // One datagram of 64 kB, two fragments, seven.
  std::vector<SampleSweep> sweeps;
  std::int64_t stamp_us = now_us - 6'000;
  for (const std::size_t points : {3'800U, 4'000U, 25'000U}) {
    sweeps.emplace_back(points, static_cast<unsigned>(points));
    publish("TESSERA_SEMANTIC_CLOUD", sweeps.back().message(++stamp_us));
    port->step(0);
  }
  publish("TESSERA_POSE", pose_message(now_us, 2));
  for (const SampleSweep& sweep : sweeps) {
    REQUIRE(eventually_stepped(*port, [&] { return port->front() != nullptr; }));
    CHECK(sweep.is_in(*port->front()));
    port->pop();
  }
  CHECK(port->report().link.fragments.messages == 2);
}

TEST_CASE("SensorSender: liblcm hears what it sends, long and short") {
  if (!enter_own_network()) return;
  const std::unique_ptr<lcm_t, void (*)(lcm_t*)> lcm(lcm_create(kDefaultSensorUrl), &lcm_destroy);
  REQUIRE(lcm != nullptr);
  std::vector<std::vector<std::byte>> heard;
  const auto hear = [](const lcm_recv_buf_t* message, const char*, void* user) {
    const auto* const bytes = static_cast<const std::byte*>(message->data);
    static_cast<std::vector<std::vector<std::byte>>*>(user)->emplace_back(
        bytes, bytes + message->data_size);
  };
  lcm_subscribe(lcm.get(), "BIG", hear, &heard);
  const auto sender = open_sender();
  std::vector<std::vector<std::byte>> sent;
  // With "BIG" and its zero, about what one datagram takes, and about two fragments.
  for (const std::size_t bytes :
       {1UL, 65'494UL, 65'495UL, 65'496UL, 130'970UL, 130'971UL, 2'000'000UL}) {
    sent.emplace_back(bytes);
    for (std::size_t i = 0; i < bytes; ++i) sent.back()[i] = static_cast<std::byte>(i * 7 / 3);
    REQUIRE(sender->send("BIG", sent.back()));
    REQUIRE(eventually([&] {
      while (lcm_handle_timeout(lcm.get(), 0) > 0) {
      }
      return heard.size() == sent.size();
    }));
  }
  CHECK(heard == sent);
  CHECK(sender->sent_messages() == sent.size());
  CHECK_FALSE(sender->send("", sent[0]));
  CHECK_FALSE(sender->send("BIG", {}));
}

TEST_CASE("SensorPort: what lcm-logger recorded lcm-logplayer plays, the same to the last bit") {
  if (!enter_own_network()) return;
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("tessera-sensing-" + std::to_string(::getpid()));
  std::filesystem::create_directory(folder);
  const std::string log = (folder / "run.lcm").string();
  constexpr unsigned kSweeps = 4;
  const auto content = [&] {
    std::ifstream file(log, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  const SensorPortConfig config = port_config();
  const std::int64_t start_us = MonotonicClock::now_us();
  const auto stamp_us = [&](unsigned i) { return start_us - 500'000 + 10'000 * std::int64_t{i}; };
  {
    const auto sender = open_sender();
    Child logger({"lcm-logger", "-q", "--flush-interval=1",
                  std::string("--lcm-url=") + kDefaultSensorUrl, log});
    const auto has_written = [&](const std::string& text) {
      sender->send(text, std::vector<std::byte>(1));
      return content().find(text) != std::string::npos;
    };
    REQUIRE(eventually([&] { return has_written("KNOCK"); }));
    for (unsigned i = 0; i < kSweeps; ++i) {
      REQUIRE(sender->send("TESSERA_POSE",
                           pose_message(stamp_us(i) - 2'000, static_cast<std::int32_t>(i))));
      REQUIRE(sender->send("TESSERA_SEMANTIC_CLOUD", SampleSweep(30'000, i).message(stamp_us(i))));
      wait_a_little();
    }
    REQUIRE(sender->send("TESSERA_POSE", pose_message(stamp_us(kSweeps), kSweeps)));
    REQUIRE(eventually([&] { return has_written("END"); }));
    CHECK(logger.end(SIGINT));
  }
  const auto port = open_port(config);
  Child player({"lcm-logplayer", "-s", "1", "-l", kDefaultSensorUrl, log});
  for (unsigned i = 0; i < kSweeps; ++i) {
    INFO("sweep " << i);
    REQUIRE(eventually_stepped(*port, [&] { return port->front() != nullptr; }));
    CHECK(port->front()->stamp_us == stamp_us(i));
    CHECK(SampleSweep(30'000, i).is_in(*port->front()));
    port->pop();
  }
  CHECK(eventually([&] { return !player.is_running(); }));
  std::filesystem::remove_all(folder);
}

TEST_CASE("SensorPort: poses from another thread serve as those that come over LCM") {
  if (!enter_own_network()) return;
  SensorPortConfig config = port_config();
  config.channels.pose = "";
  const auto port = open_port(config);
  REQUIRE(port->start().ok());
  const auto sender = open_sender();
  const std::int64_t now_us = port->stamp_now_us();
  const SampleSweep sweep(10, 1);
  REQUIRE(port->add_pose({.stamp_us = now_us - 2'000}));
  REQUIRE(sender->send("TESSERA_SEMANTIC_CLOUD", sweep.message(now_us)));
  REQUIRE(port->add_pose({.stamp_us = now_us + 1}));
  REQUIRE(eventually([&] { return port->front() != nullptr; }));
  CHECK(sweep.is_in(*port->front()));
  port->pop();
}

TEST_CASE("SensorPort: poses that are forgotten serve no scan, nor those that still wait then") {
  if (!enter_own_network()) return;
  const auto port = open_port(port_config());
  const auto sender = open_sender();
  const std::int64_t now_us = port->stamp_now_us();
  REQUIRE(port->add_pose({.stamp_us = now_us - 4'000}));
  port->step(0);
  REQUIRE(port->add_pose({.stamp_us = now_us - 2'000}));
  port->forget_poses();
  REQUIRE(sender->send("TESSERA_SEMANTIC_CLOUD", SampleSweep(10, 1).message(now_us)));
  REQUIRE(port->add_pose({.stamp_us = now_us + 1}));
  REQUIRE(eventually_stepped(*port, [&] { return port->report().match.without_pose == 1; }));
  CHECK(port->front() == nullptr);
}

TEST_CASE("SensorPort: a raw cloud with its camera's labels, and a depth image with its own") {
  if (!enter_own_network()) return;
  SensorPortConfig config = port_config();
  config.matcher.sensors = {{1, MountedKind::kRawCloud}, {5, MountedKind::kDepthCamera}};
  config.matcher.cameras = {0};
  config.matcher.slot = {.points = 100, .image_pixels = 6};
  const auto port = open_port(config);
  const auto sender = open_sender();
  const std::int64_t now_us = port->stamp_now_us();
  const std::int64_t depth_us = now_us - 1'000;
  const std::vector<float> xyz{1.0F, 2.0F, 3.0F};
  const std::vector<std::uint8_t> labels{1, 2, 3, 4, 5, 6};
  const std::vector<std::uint16_t> depth_mm{0, 1'500, 65'535, 1, 2, 3};
  const auto image = [&](std::int64_t stamp_us, std::int32_t camera) {
    const ImageHeader header{.stamp_us = stamp_us, .camera = camera, .width_px = 3, .height_px = 2};
    return std::pair(header, encode(ImageToSend{header, labels}));
  };
  REQUIRE(sender->send("TESSERA_POSE", pose_message(now_us - 5'000, 1)));
  REQUIRE(sender->send("TESSERA_CLOUD",
                       encode(CloudToSend{.stamp_us = now_us, .sensor = 1, .xyz = xyz})));
  REQUIRE(sender->send("TESSERA_DEPTH_IMAGE", encode(DepthToSend{.header = image(depth_us, 5).first,
                                                                 .depth_mm = depth_mm})));
  REQUIRE(sender->send("TESSERA_LABEL_IMAGE", image(depth_us, 5).second));
  REQUIRE(sender->send("TESSERA_LABEL_IMAGE", image(now_us + 500, 0).second));
  REQUIRE(sender->send("TESSERA_POSE", pose_message(now_us + 1'000, 2)));
  REQUIRE(eventually_stepped(*port, [&] { return port->front() != nullptr; }));
  const Scan& depth = *port->front();
  CHECK(depth.kind == ScanKind::kDepthImage);
  CHECK(depth.stamp_us == depth_us);
  REQUIRE(depth.depth_m().size() == 6);
  CHECK(depth.depth_m()[1] == 1.5F);
  REQUIRE(depth.images().size() == 1);
  CHECK(std::equal(labels.begin(), labels.end(), depth.images()[0].components().begin()));
  port->pop();
  REQUIRE(eventually_stepped(*port, [&] { return port->front() != nullptr; }));
  const Scan& cloud = *port->front();
  CHECK(cloud.kind == ScanKind::kCloud);
  CHECK_FALSE(cloud.has_components);
  CHECK(cloud.view().components == nullptr);
  CHECK(cloud.view().points[2] == 3.0F);
  REQUIRE(cloud.images().size() == 1);
  CHECK(cloud.images()[0].stamp_us == now_us + 500);
  CHECK_FALSE(cloud.images_missing);
  port->pop();
}

TEST_CASE("SensorPort: hears, matches and hands over without the heap") {
  if (!enter_own_network()) return;
  const auto port = open_port(port_config());
  const auto sender = open_sender();
  const SampleSweep sweep(20'000, 1);
  std::vector<std::byte> message = sweep.message(0);
  std::vector<std::byte> pose = pose_message(0, 1);
  const auto stamp = [](std::vector<std::byte>& bytes, std::int64_t stamp_us) {
    for (std::size_t i = 0; i < 8; ++i)
      bytes[8 + i] = static_cast<std::byte>(stamp_us >> (56 - 8 * i));
  };
  const auto before = heap_allocations();
  int received = 0;
  for (int i = 0; i < 50; ++i) {
    const std::int64_t now_us = port->stamp_now_us();
    stamp(message, now_us - 1);
    stamp(pose, now_us - 2'000);
    sender->send("TESSERA_POSE", pose);
    sender->send("TESSERA_SEMANTIC_CLOUD", message);
    stamp(pose, now_us);
    sender->send("TESSERA_POSE", pose);
    const bool came = eventually_stepped(*port, [&] { return port->front() != nullptr; });
    if (!came) break;
    ++received;
    port->pop();
  }
  const auto after = heap_allocations();
  CHECK(received == 50);
  if (!before) {
    WARN("this build cannot count heap allocations");
    return;
  }
  CHECK(*after - *before == 0);
}

TEST_CASE("SensorPort: open says what is wrong") {
  if (!enter_own_network()) return;
  const auto refusal = [](auto change) {
    SensorPortConfig config = port_config();
    config.matcher.slot.points = 1;
    change(config);
    const auto port = SensorPort::open(config);
    REQUIRE_FALSE(port.ok());
    CHECK(port.failure().kind == FailureKind::kUsage);
    return port.failure().text();
  };
  const auto has = [](const std::string& text, const char* word) {
    return text.find(word) != std::string::npos;
  };
  CHECK(has(refusal([](SensorPortConfig& c) { c.link.url = "udpm://239.255.76.68:7668?ttl=1"; }),
            "ttl=0"));
  CHECK(has(refusal([](SensorPortConfig& c) { c.link.interface = "eth99"; }), "eth99"));
  CHECK(has(refusal([](SensorPortConfig& c) { c.channels.cloud = c.channels.pose; }), "duplicate"));
  CHECK(has(refusal([](SensorPortConfig& c) { c.channels.pose = std::string(64, 'x'); }), "63"));
}

}  // namespace
}  // namespace tessera

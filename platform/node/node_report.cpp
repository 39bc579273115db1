// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The report of "node".
#include <array>

#include "base/counters_json.hpp"
#include "base/monotonic_clock.hpp"
#include "base/number_text.hpp"
#include "maps/judged_robot.hpp"
#include "node/node.hpp"
#include "scans/scan_losses.hpp"

namespace tessera {

namespace {

double ms_of(std::int64_t us) { return 1e-3 * static_cast<double>(us); }

Json times_json(const DurationHistogram& times) {
  return {{"count", times.count()},
          {"median_ms", ms_of(times.quantile_us(0.5))},
          {"p99_ms", ms_of(times.quantile_us(0.99))},
          {"max_ms", ms_of(times.max_us())}};
}

/// Including a histogram: [milliseconds at most, count].
Json histogram_json(const DurationHistogram& times) {
  Json json = times_json(times);
  Json buckets = Json::array();
  times.for_each([&](std::int64_t most_us, std::uint64_t count) {
    buckets.push_back({ms_of(most_us), count});
  });
  json["buckets"] = std::move(buckets);
  return json;
}

Json publisher_json(const Publisher& publisher) {
  const PublisherTotals& totals = publisher.totals();
  Json json = counters_json(static_cast<const TickSums&>(totals));
  json["forgotten_waiting"] = totals.forgotten_waiting;
  json["peak_waiting"] = totals.peak_waiting;
  json["waiting"] = publisher.waiting();
  json["by_staleness"] = totals.by_staleness;
  return json;
}

Json link_json(const NetworkPort& port) {
  Json json = counters_json(port.link().report());
  json["interface"] = port.link().interface().name;
  json["receive_buffer_bytes"] = port.link().receive_buffer_bytes();
  json["send_queue_full"] = port.send_queue_full();
  json["send_queue_peak"] = port.send_queue_peak();
  return json;
}

Json contributions_json(const Robot& robot) {
  std::vector<ContributionState> states(robot.exchange().contributions({}));
  states.resize(robot.exchange().contributions(states));
  const Replicas& replicas = robot.global().replicas();
  Json json = Json::array();
  for (const ContributionState& state : states) {
    Json one = {{"robot", state.id.robot},        {"epoch", state.id.epoch},
                {"submap", state.id.submap},      {"own", state.own},
                {"complete", state.complete},     {"far", state.far},
                {"latest_version", state.latest}, {"covered_to", state.covered},
                {"digest", hex64(state.digest)}};
    const Result<Replicas::Slot> slot = replicas.find(state.id);
    if (MapSession::is(state.id.submap)) one["session"] = to_json(state.session);
    if (Objection::is(state.id.submap)) one["objections"] = true;
    if (FrameStatements::is(state.id.submap)) one["frame_statements"] = true;
    one["parts"] = slot.ok() ? Json(replicas.contribution(*slot).blocks) : Json(0);
    json.push_back(std::move(one));
  }
  return json;
}

Json peers_json(const Robot& robot, std::int64_t now_us) {
  Json json = Json::array();
  for (const Peer& peer : robot.exchange().peers().all()) {
    const std::string mismatch =
        peer.mismatch ? mismatch_text(*peer.mismatch, robot.exchange().configuration()) : "";
    json.push_back(
        {{"robot", peer.robot},
         {"session", peer.control.session},
         {"datagrams", peer.datagrams},
         {"silent_s", 1e-6 * static_cast<double>((Instant::at_us(now_us) - peer.heard).us)},
         {"left", peer.left},
         {"mismatch", mismatch}});
  }
  return json;
}

Json global_json(const Robot& robot) {
  const GlobalMapReport r = robot.global().report();
  const MapUsage usage = robot.global().map().usage();
  Json json = counters_json(r);
  add_counters(json, r.replicas);
  json["label_voxels"] = usage.label_voxels;
  json["free_voxels"] = robot.global().map().count_free_voxels();
  json["overlap_voxels"] = r.nodes;
  json["refused_replicas"] =
      r.replicas.replicas_refused_storage + r.replicas.replicas_refused_quota;
  json["work"] = robot.fusion_work();
  return json;
}

}  // namespace

std::string mismatch_text(const ConfigurationDetails& theirs, const ConfigurationDetails& ours) {
  std::string text;
  const auto add = [&text](const std::string& what) { text += (text.empty() ? "" : ", ") + what; };
  const auto differs = [&add](const char* what, double their, double our) {
    if (their < our || their > our)
      add(std::string(what) + " is " + text_of(their) + " there and " + text_of(our) + " here");
  };
  differs("resolution_m", theirs.resolution_m, ours.resolution_m);
  differs("prior", theirs.prior, ours.prior);
  differs("free_weight", decimal_of(theirs.free_weight), decimal_of(ours.free_weight));
  differs("max_evidence", decimal_of(theirs.max_evidence), decimal_of(ours.max_evidence));
  differs("number of classes", theirs.classes, ours.classes);
  if (theirs.conflicts != ours.conflicts) {
    const bool theirs_excludes = theirs.conflicts == ConflictPolicy::kExclude;
    add(std::string("[security] conflicts is ") +
        (theirs_excludes ? "exclude there and alarm here" : "alarm there and exclude here"));
  }
  if (text.empty()) add("ids or names of classes differ");
  return text + "; give both robots the same";
}

Json Node::mapping_json() const {
  const MappingThreadState& m = run_.mapping;
  return {{"period_ms", config_.period_ms},
          {"cycles", m.cycles},
          {"missed", m.missed},
          {"late", m.late},
          {"shed", m.shed},
          {"refused_memory", left_out_for_memory(m.scans)},
          {"refused_work", left_out_for_work(m.scans)},
          {"refused_time", m.scans.left_out_deadline},
          {"over_capacity", m.scans.over_capacity},
          {"paused", m.paused},
          {"lost", run_.source.lost},
          {"clears", m.clears},
          {"waited_ms", 1e-3 * static_cast<double>(m.waited_us)},
          {"saves", saves_.load()},
          {"failed_saves", failed_saves_.load()},
          {"failed_records", failed_records()},
          {"kept_maps", run_.kept_maps},
          {"failed_keeps", run_.failed_keeps},
          {"cycle_times", histogram_json(mapping_->cycles())},
          {"latencies", histogram_json(mapping_->latencies())},
          {"thread", mapping_->thread_number()},
          {"minor_page_faults", mapping_->page_faults().minor},
          {"major_page_faults", mapping_->page_faults().major}};
}

Json Node::memory_json() const {
  const Robot& robot = *robot_;
  const GlobalMapReport r = robot.global().report();
  const std::size_t archive_bytes = archive_ ? archive_->memory_bytes() : 0;
  return {{"budget_bytes", robot.memory_bytes() + archive_bytes},
          {"used_bytes", robot.used_bytes() + archive_bytes},
          {"map_used_bytes", robot.map().usage().used_bytes},
          {"global_used_bytes", r.used_bytes},
          {"global_map_used_bytes", robot.global().map().usage().used_bytes},
          {"replica_bytes", r.replicas.replica_bytes},
          {"sum_bytes", r.sum_bytes}};
}

Json Node::submaps_json() const {
  const SubmapCounts& mapped = run_.mapping.submaps;
  const SubmapReport& shared = (*robot_).sharer().submap();
  Json rows = Json::array();
  for (const SubmapRow& row : kept_->rows())
    rows.push_back({{"number", row.number}, {"bytes", row.bytes}, {"length_m", row.length_m}});
  return {{"number", robot_->maps().number()},
          {"by_length", mapped.by_length},
          {"by_jump", mapped.by_jump},
          {"by_memory", mapped.by_memory},
          {"late", mapped.late},
          {"left_out", mapped.left_out},
          {"lost_blocks", shared.lost_blocks},
          {"cut_short", shared.cut_short},
          {"corrections", shared.corrections},
          {"refused_corrections", shared.refused_corrections},
          {"refused_frames", shared.refused_frames},
          {"revision", shared.revision},
          {"corrected_most_m", shared.corrected_most_m},
          {"kept", std::move(rows)}};
}

Json Node::state_json() const {
  return {{"map_epoch", state_->map_epoch()},
          {"resumed_blocks", durable_->resumed_blocks()},
          {"damaged_bytes", durable_->damaged_bytes()},
          {"torn_bytes", durable_->torn_bytes()},
          {"file_bytes", durable_->file_bytes()},
          {"left_out_blocks", durable_->left_out_blocks()},
          {"notes", run_.restart_notes},
          {"published_again", earlier_ ? earlier_->published() : 0U},
          {"failed_renewals", durable_->failed_renewals()},
          {"written_bytes", durable_->written_bytes()},
          {"failed", run_.failed_states},
          {"most_lost_ms", ms_of(run_.most_lost_us)}};
}

Json Node::realtime_json() const {
  return {{"memory_locked", config_.lock_memory && run_.not_locked.empty()},
          {"why_not_locked", run_.not_locked},
          {"priority_permitted", run_.missing.priority == 0},
          {"cpus_permitted", !run_.missing.cpus},
          {"silences", run_.silences},
          {"first_scan_ms",
           run_.mapping.first_us != 0 ? Json(ms_of(run_.mapping.first_us - run_.made_us)) : Json()},
          {"start_resident_bytes", run_.start_resident_bytes},
          {"end_resident_bytes", run_.end_resident_bytes},
          {"map_is_behind", run_.map_is_behind},
          {"save_ms", ms_of(run_.save_us)}};
}

Json Node::report() const {
  const ExchangeReport exchange = robot_->exchange().report();
  const double seconds = 1e-6 * static_cast<double>(run_.end_us - run_.start_us);
  Json json = {{"robot", config_.robot},
               {"epoch", epoch_.load()},
               {"ended_by", run_.ended_by},
               {"seconds", seconds},
               {"cpu_seconds", run_.cpu_s},
               {"digest", hex64(global_digest_)},
               {"exchange_digest", hex64(robot_->exchange().digest())},
               {"local_digest", hex64(local_digest_.value_or(0))}};
  Json scans = counters_json(run_.mapping.scans);
  scans["integrated"] = run_.mapping.cycles;
  scans["unknown_ids"] = run_.source.unknown_ids;
  scans["bad_poses"] = run_.mapping.bad_poses;
  scans["worst_late_ms"] = ms_of(run_.mapping.worst_late_us);
  scans["times"] = times_json(mapping_->cycles());
  json["scans"] = std::move(scans);
  json["mapping"] = mapping_json();
  json["realtime"] = realtime_json();
  if (sensing_) json["sensors"] = sensors_json();
  if (vehicle_) json["vehicle"] = vehicle_json();
  if (queries_) json["queries"] = queries_json();
  if (view_) json["view"] = view_json();
  Json ticks = times_json(times().ticks);
  ticks["period_ms"] = config_.tick_ms;
  ticks["overruns"] = times().overruns;
  ticks["worst_late_ms"] = ms_of(times().worst_late_us);
  json["ticks"] = std::move(ticks);
  json["receive_times"] = histogram_json(times().receiving);
  json["sent_bytes"] = exchange.sent_bytes;
  json["received_bytes"] = exchange.received_bytes;
  json["heap_allocations_after_start"] =
      run_.heap_allocations ? Json(*run_.heap_allocations) : Json();
  json["global_map"] = global_json(*robot_);
  json["reliability"] = to_json(judge_robots(robot_->global()), robot_->global().map().classes());
  json["frames"] = to_json(frames_.view());
  json["memory"] = memory_json();
  if (archive_) json["window"] = to_json(window_);
  if (kept_) json["submaps"] = submaps_json();
  if (durable_) json["state"] = state_json();
  json["sessions"] = sessions_.report();
  json["contributions"] = contributions_json(*robot_);
  json["objections"] = counters_json(robot_->sharer().objections());
  json["peers"] = peers_json(*robot_, run_.end_us);
  json["exchange"] = counters_json(exchange);
  json["publisher"] = publisher_json(robot_->publisher());
  json["link"] = link_json(*port_);
  json["security"] = security_json();
  Json snapshots = Json::array();
  for (const Snapshot& snapshot : run_.snapshots) {
    snapshots.push_back({{"file", snapshot.path},
                         {"after_s", snapshot.after_s},
                         {"label_voxels", snapshot.label_voxels}});
  }
  json["snapshots"] = std::move(snapshots);
  json["failed_snapshots"] = run_.failed_snapshots;
  json["config"] = config_.values;
  return json;
}

}  // namespace tessera

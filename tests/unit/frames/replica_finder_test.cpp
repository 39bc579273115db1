// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A finder over what robots have published answers as over their maps.
#include "finder_rig.hpp"
#include "replica_rig.hpp"
#include "tessera/exchange/exchange.hpp"
#include "tessera/exchange/internal/block_codec.hpp"
#include "tessera/frames/search_reach.hpp"

namespace tessera {

namespace {

constexpr ReplicasConfig kTeamRoom{
    .segments = 1U << 15U, .blocks = 4'096, .contributions = 4, .robot_segments = 1U << 15U};

/// A robot that publishes a map, and holds what others have published.
class PublishingRobot {
 public:
  PublishingRobot(std::uint32_t robot, const LocalMap& map)
      : own_(kTeamRoom), packer_(map.num_components()), published_(map.config(), map.classes()) {
    const ExchangeConfig config{.robot = robot,
                                .resolution_m = map.config().resolution_m,
                                .prior = map.config().prior,
                                .free_weight = map.config().free_weight,
                                .contributions = 4,
                                .records = kTeamRoom.blocks};
    memory_.emplace(Exchange::required_bytes(config, map.num_components()));
    Arena arena = memory_->arena();
    exchange_ =
        *Exchange::make(arena, config, store_of(own_.replicas), crc_authenticator(), map.classes());
    REQUIRE(exchange_.open(1, 0, Matrix34d::Identity()) == Status::kOk);
    SweepCursor cursor;
    map.visit_blocks(cursor, map.index().slots(), [&](BlockKey key, SlabHandle handle) {
      publish(map, key, handle);
      return true;
    });
  }
  /// Those of its blocks that are in this range along x.
  void publish_again(const LocalMap& map, int first, int last) {
    SweepCursor cursor;
    map.visit_blocks(cursor, map.index().slots(), [&](BlockKey key, SlabHandle handle) {
      const int x = unpack(key).x;
      if (x >= first && x <= last) publish(map, key, handle);
      return true;
    });
  }
  [[nodiscard]] Exchange& exchange() { return exchange_; }
  [[nodiscard]] const Replicas& replicas() const { return own_.replicas; }
  [[nodiscard]] Replicas& replicas() { return own_.replicas; }
  /// A map of what was published, as it was rounded for it.
  [[nodiscard]] const LocalMap& published() const { return published_.map; }
  [[nodiscard]] Replicas::Slot slot_of(std::uint32_t robot) const {
    const Result<Replicas::Slot> slot = own_.replicas.find({robot, 1, 0});
    REQUIRE(slot.ok());
    return *slot;
  }

 private:
  void publish(const LocalMap& map, BlockKey key, SlabHandle handle) {
    BlockContent& content = packer_.content();
    content.clear();
    add_block(map, map.block_at(handle), content);
    quantise(content);
    REQUIRE(exchange_.publish(key, content).ok());
    const Result<SlabHandle> block = published_.map.open_block(unpack(key));
    REQUIRE(block.ok());
    REQUIRE(published_.map.replace(*block, content) == Status::kOk);
  }

  OwnReplicas own_;
  BlockPacker packer_;
  WorldMap published_;
  std::optional<AlignedMemory> memory_;
  Exchange exchange_;
};

/// Until b has all that a has published.
void send_all(PublishingRobot& a, PublishingRobot& b) {
  std::vector<std::byte> datagram(kMostDatagramBytes);
  const ContributionId id = *a.exchange().publishing();
  const std::uint32_t parts = a.replicas().contribution(a.slot_of(id.robot)).blocks;
  const auto arrived = [&] {
    const Result<Replicas::Slot> slot = b.replicas().find(id);
    return slot.ok() && b.replicas().contribution(*slot).blocks == parts;
  };
  for (std::int64_t now_us = 0; now_us < 60'000'000 && !arrived(); now_us += 50'000) {
    while (const std::size_t size = a.exchange().send(now_us, datagram))
      b.exchange().receive(std::span(datagram).first(size), now_us);
    while (const std::size_t size = b.exchange().send(now_us, datagram))
      a.exchange().receive(std::span(datagram).first(size), now_us);
  }
  REQUIRE(arrived());
}

FrameAnswer find(FinderRig& rig, const SketchSource& a, const SketchSource& b) {
  REQUIRE(rig.finder.begin(a, b, FinderRig::nearby()) == Status::kOk);
  while (!rig.finder.step() && rig.finder.steps() < 100'000) continue;
  return rig.finder.answer();
}

}  // namespace

TEST_CASE("what was published and heard gives the sketches and the answer of maps, to the bit") {
  const SolidWorld hall = large_hall();
  const Matrix34d T_b_world = frame_of(37.0, 3.0, 50.0, {-8.0, 9.0, -2.3});
  ClassTable classes = room_classes();
  for (const char* const name : {"tree", "pole", "car", "sign", "door", "roof"})
    REQUIRE(classes.add(name, {}, false) == Status::kOk);
  const auto a = map_of(hall, left_of(22.0), classes);
  const auto b = map_of(hall, right_of(8.0, T_b_world), classes);
  // Evidence of several classes, which the wire rounds, and of which blocks take several parts.
  oracle::Random random(3);
  for (int n = 0; n < 20'000; ++n) {
    const VoxelCoord voxel{random.below(16), random.below(16), random.below(8)};
    const auto count = static_cast<float>(std::exp2(random.uniform(-6.0, 3.0)));
    REQUIRE(hit(b->map, voxel, 1 + random.below(9), count) == Status::kOk);
  }
  PublishingRobot here(0, a->map);
  PublishingRobot there(1, b->map);
  send_all(there, here);
  const Replicas::Contribution& of_b = here.replicas().contribution(here.slot_of(1));
  CHECK(of_b.blocks > b->map.block_count());  // parts
  OwnSource from_a(a->map.config(), a->map.classes(), kTeamRoom);
  OwnSource from_b(b->map.config(), b->map.classes(), kTeamRoom);
  REQUIRE(from_a.source.begin(here.replicas(), here.slot_of(0)) == Status::kOk);
  REQUIRE(from_b.source.begin(here.replicas(), here.slot_of(1)) == Status::kOk);

  FinderRig by_replicas;
  FinderRig by_maps;
  const FrameAnswer heard = find(by_replicas, from_a.source.source(), from_b.source.source());
  const FrameAnswer known = by_maps.find(here.published(), there.published());
  CHECK_FALSE(from_a.source.lost());
  CHECK_FALSE(from_b.source.lost());
  CHECK(same_sketch(by_replicas.finder.sketch_a(), by_maps.finder.sketch_a()));
  CHECK(same_sketch(by_replicas.finder.sketch_b(), by_maps.finder.sketch_b()));
  CHECK(heard.verdict == FrameVerdict::kFound);
  CHECK(heard.T_a_b == known.T_a_b);
  CHECK(heard.covariance == known.covariance);
  CHECK(heard.support == known.support);
  CHECK(heard.support_second == known.support_second);
  CHECK(error_of(heard, inverse(T_b_world)).shift_m < 0.1);
  // A map and replicas go together, and what was published of this one says what it says.
  const FrameAnswer mixed =
      find(by_replicas, sketch_source_of(here.published()), from_b.source.source());
  CHECK(mixed.T_a_b == known.T_a_b);
}

TEST_CASE("a refinement reads what has changed, and gives what one with new sketches gives") {
  const SolidWorld hall = large_hall();
  const Matrix34d T_b_world = frame_of(37.0, 3.0, 50.0, {-8.0, 9.0, -2.3});
  const auto a = map_of(hall, left_of(20.0), room_classes());
  const auto more = map_of(hall, left_of(24.0), room_classes());
  const auto b = map_of(hall, right_of(8.0, T_b_world), room_classes());
  PublishingRobot here(0, a->map);
  PublishingRobot there(1, b->map);
  send_all(there, here);
  OwnSource from_a(a->map.config(), a->map.classes(), kTeamRoom);
  OwnSource from_b(b->map.config(), b->map.classes(), kTeamRoom);
  const auto search = [&](FinderRig& rig, OwnSource& of_a, OwnSource& of_b,
                          const FrameQuestion& question) {
    REQUIRE(of_a.source.begin(here.replicas(), here.slot_of(0)) == Status::kOk);
    REQUIRE(of_b.source.begin(here.replicas(), here.slot_of(1)) == Status::kOk);
    REQUIRE(rig.finder.begin(of_a.source.source(), of_b.source.source(), question) == Status::kOk);
    std::uint32_t percent = 0;
    while (!rig.finder.step() && rig.finder.steps() < 100'000) {
      CHECK(rig.finder.percent() >= percent);
      percent = rig.finder.percent();
    }
    CHECK(rig.finder.percent() == 100);
    return rig.finder.answer();
  };
  FinderRig kept;
  const FrameAnswer found = search(kept, from_a, from_b, FinderRig::nearby());
  REQUIRE(found.verdict == FrameVerdict::kFound);
  here.publish_again(more->map, 11, 13);
  const FrameQuestion question = refinement_of(found.T_a_b);
  const FrameAnswer refined = search(kept, from_a, from_b, question);
  CHECK(from_a.source.blocks_taken() > 50);
  CHECK(from_a.source.blocks_taken() < a->map.block_count() / 3);
  CHECK(from_b.source.blocks_taken() == 0);
  CHECK(refined.verdict == FrameVerdict::kFound);
  CHECK(refined.agreement.agreed > found.agreement.agreed);
  CHECK(error_of(refined, found.T_a_b).shift_m < 0.05);
  FinderRig fresh;
  OwnSource fresh_a(a->map.config(), a->map.classes(), kTeamRoom);
  OwnSource fresh_b(b->map.config(), b->map.classes(), kTeamRoom);
  const FrameAnswer again = search(fresh, fresh_a, fresh_b, question);
  CHECK(fresh_b.source.blocks_taken() == b->map.block_count());
  CHECK(again.T_a_b == refined.T_a_b);
  CHECK(again.covariance == refined.covariance);
  CHECK(again.support == refined.support);
  INFO("a search finds the same from sketches that went on");
  const FrameAnswer searched = search(kept, from_a, from_b, FinderRig::nearby());
  CHECK(searched.T_a_b == search(fresh, fresh_a, fresh_b, FinderRig::nearby()).T_a_b);
  CHECK(error_of(refined, searched.T_a_b).shift_m < 0.02);
  INFO("where it is not, it is not found");
  Matrix34d off = found.T_a_b;
  off(0, 3) += 2.0;
  CHECK(search(kept, from_a, from_b, refinement_of(off)).verdict != FrameVerdict::kFound);
}

TEST_CASE("a contribution that is closed while it is taken, or makes room for another, is lost") {
  const auto map = map_of(large_hall(), left_of(22.0), room_classes());
  PublishingRobot robot(0, map->map);
  PublishingRobot other(1, map->map);
  send_all(other, robot);
  Replicas& replicas = robot.replicas();
  OwnSource from(map->map.config(), map->map.classes(), kTeamRoom);
  const Replicas::Slot slot = robot.slot_of(1);
  const ContributionId id = replicas.contribution(slot).id;
  REQUIRE(from.source.begin(replicas, slot) == Status::kOk);
  FinderRig rig;
  REQUIRE(rig.finder.begin(from.source.source(), from.source.source(), FinderRig::nearby()) ==
          Status::kOk);
  REQUIRE_FALSE(rig.finder.step());
  CHECK(from.source.blocks_taken() == ReplicaSketchSource::kBlocks);
  SECTION("leaving") { replicas.set_leaving(slot); }
  SECTION("closed, or reopened") {
    const bool reopened = GENERATE(false, true);
    std::vector<std::uint64_t> keys;
    while (replicas.contribution(slot).first_block != 0) {
      const std::uint32_t number = replicas.contribution(slot).first_block;
      keys.push_back(replicas.record(number).key);
      replicas.drop(number);
    }
    replicas.close(slot);
    if (reopened) {
      // With the same blocks, which are not the ones that were begun.
      REQUIRE(*replicas.open({1, 2, 0}) == slot);
      BlockPacker packer(map->map.num_components());
      packer.content().add(1, 0, 4.0F);
      for (const std::uint64_t key : keys)
        REQUIRE(replicas.put(slot, BlockKey{key}, 1, packer.pack()).ok());
    }
  }
  while (!rig.finder.step()) REQUIRE(rig.finder.steps() < 100'000);
  CHECK(from.source.lost());
  CHECK(from.source.id() == id);
  CHECK(from.source.blocks_taken() == ReplicaSketchSource::kBlocks);
  CHECK(rig.finder.answer().verdict == FrameVerdict::kTooLittle);
  // Another contribution begins anew.
  REQUIRE(from.source.begin(replicas, robot.slot_of(0)) == Status::kOk);
  CHECK_FALSE(from.source.lost());
  TakenSketch taken;
  taken.take(from.source.source());
  CHECK(from.source.blocks_taken() == map->map.block_count());
}

TEST_CASE("a source without a function or a resolution is refused") {
  const auto map = map_of(large_hall(), left_of(4.0), room_classes());
  FinderRig rig;
  const SketchSource good = sketch_source_of(map->map);
  CHECK(rig.finder.begin(good, good, {}) == Status::kOk);
  CHECK(rig.finder.begin(good, {}, {}) == Status::kInvalidArgument);
  SketchSource flat = good;
  flat.resolution_m = 0.0;
  CHECK(rig.finder.begin(flat, good, {}) == Status::kInvalidArgument);
}

}  // namespace tessera

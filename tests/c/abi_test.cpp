// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What programs that are compiled already rely on: the layout of structs, the numbers of
// enumerations, and that these are the core's.
#include <catch2/catch.hpp>
#include <cstddef>
#include <string>
#include <type_traits>

#include "tessera/frames/frame_finder.hpp"
#include "tessera/map/cast_ray.hpp"
#include "tessera/robot/robot.hpp"
#include "tessera/tessera.h"

namespace tessera {
namespace {

#define SIZE(type, bytes)                                                     \
  static_assert(sizeof(type) == (bytes) && std::is_standard_layout_v<type> && \
                std::is_trivially_copyable_v<type>);
#define FIELD(type, field, bytes) static_assert(offsetof(type, field) == (bytes));
static_assert(sizeof(void*) != 8 || sizeof(std::size_t) == 8);
#if UINTPTR_MAX == UINT64_MAX
#include "layout.inc"
#endif
#undef SIZE
#undef FIELD

template <class Kind>
constexpr auto number(Kind kind) {
  return static_cast<std::uint32_t>(kind);
}

static_assert(sizeof(tessera_status) == 4);
static_assert(TESSERA_OK == number(Status::kOk));
static_assert(TESSERA_INVALID_ARGUMENT == number(Status::kInvalidArgument));
static_assert(TESSERA_RESOURCE_EXHAUSTED == number(Status::kResourceExhausted));
static_assert(TESSERA_OUT_OF_RANGE == number(Status::kOutOfRange));
static_assert(TESSERA_MISMATCH == number(Status::kMismatch));
static_assert(TESSERA_CORRUPT == number(Status::kCorrupt));
static_assert(TESSERA_TRUNCATED == number(Status::kTruncated));
static_assert(TESSERA_UNSUPPORTED == number(Status::kUnsupported));
static_assert(TESSERA_IO == number(Status::kIo));
static_assert(TESSERA_BUSY == number(Status::kBusy));

static_assert(TESSERA_COUNTING == number(InferenceMode::kCounting));
static_assert(TESSERA_KERNEL == number(InferenceMode::kKernel));
static_assert(TESSERA_MULTI_ENTROPY == number(InferenceMode::kMultiEntropy));
static_assert(TESSERA_LATTICE == number(InferenceMode::kLattice));
static_assert(TESSERA_DENSE == number(TuplePolicy::kDense));
static_assert(TESSERA_COMPACT == number(TuplePolicy::kCompact));
static_assert(TESSERA_THINNING_MEAN == number(ThinningWeight::kMean));
static_assert(TESSERA_THINNING_SUM == number(ThinningWeight::kSum));
static_assert(TESSERA_CONTRACTIVE == number(DiffusionMode::kContractive));
static_assert(TESSERA_PAPER == number(DiffusionMode::kPaper));
static_assert(TESSERA_NO_DIFFUSION == number(DiffusionMode::kNone));
static_assert(TESSERA_EDGE_DISTANCE == number(EdgeTerm::kNone));
static_assert(TESSERA_EDGE_LABEL == number(EdgeTerm::kLabel));
static_assert(TESSERA_EDGE_SIMILARITY == number(EdgeTerm::kSimilarity));
static_assert(TESSERA_EDGE_CONFIDENCE == number(EdgeTerm::kConfidence));
static_assert(TESSERA_UNKNOWN == number(VoxelState::kUnknown));
static_assert(TESSERA_FREE == number(VoxelState::kFree));
static_assert(TESSERA_OCCUPIED == number(VoxelState::kOccupied));
static_assert(TESSERA_RAY_MAX_RANGE == number(RayHit::End::kMaxRange));
static_assert(TESSERA_RAY_OCCUPIED == number(RayHit::End::kOccupied));
static_assert(TESSERA_RAY_UNKNOWN == number(RayHit::End::kUnknown));
static_assert(TESSERA_RAY_INVALID == number(RayHit::End::kInvalid));

static_assert(TESSERA_FRAME_FOUND == number(FrameVerdict::kFound));
static_assert(TESSERA_FRAME_TOO_LITTLE == number(FrameVerdict::kTooLittle));
static_assert(TESSERA_FRAME_NONE_FITS == number(FrameVerdict::kNoneFits));
static_assert(TESSERA_FRAME_CONTRADICTED == number(FrameVerdict::kContradicted));
static_assert(TESSERA_FRAME_AMBIGUOUS == number(FrameVerdict::kAmbiguous));
static_assert(TESSERA_FRAME_LOOSE == number(FrameVerdict::kLoose));
static_assert(TESSERA_FRAME_OUT_OF_REACH == number(FrameVerdict::kOutOfReach));

static_assert(TESSERA_FRAMES_GIVEN == number(FrameMode::kGiven));
static_assert(TESSERA_FRAMES_REFINED == number(FrameMode::kRefined));
static_assert(TESSERA_FRAMES_FOUND == number(FrameMode::kFound));
static_assert(TESSERA_PLACED_GIVEN == number(FrameState::kGiven));
static_assert(TESSERA_PLACED_ROUGHLY == number(FrameState::kPlaced));
static_assert(TESSERA_PLACED_BY_LINKS == number(FrameState::kLinked));
static_assert(TESSERA_PLACED_BY_ONE == number(FrameState::kOnlyByOne));
static_assert(TESSERA_PLACED_ALONE == number(FrameState::kAlone));
static_assert(TESSERA_PLACED_WITHDRAWN == number(FrameState::kWithdrawn));
static_assert(TESSERA_PLACED_CONTRADICTED == number(FrameState::kContradicted));

static_assert(TESSERA_ALIGNMENT == kArenaAlignment);
static_assert(TESSERA_MOST_DATAGRAM_BYTES == kMostDatagramBytes);
static_assert(TESSERA_MOST_CLASSES == kMaxClasses);
static_assert(TESSERA_TAG_BYTES == kTagBytes);
static_assert(TESSERA_SIGNATURE_BYTES == kSignatureBytes);
static_assert(TESSERA_HASH_BYTES == kHashBytes);
static_assert(TESSERA_CONFIG_LEAST_BYTES % 8 == 0);
// What version 1 had: these never change, whatever is appended to the structs.
static_assert(sizeof(void*) != 8 ||
              (TESSERA_SCAN_LEAST_BYTES == 152 && TESSERA_CALLBACKS_LEAST_BYTES == 80 &&
               TESSERA_CONFIG_LEAST_BYTES == 168));
static_assert(sizeof(tessera_class::name) == SemanticClass::kNameBytes);

TEST_CASE("C interface: each status has the core's words, and there are no more") {
  for (std::uint32_t i = 0; i <= TESSERA_BUSY; ++i) {
    CHECK(std::string(tessera_status_text(i)) == to_string(static_cast<Status>(i)));
  }
  CHECK(std::string(to_string(static_cast<Status>(TESSERA_BUSY + 1))) == "unknown status");
}

TEST_CASE("C interface: defaults are the core's") {
  tessera_config config;
  REQUIRE(tessera_config_init(&config, sizeof(config)) == TESSERA_OK);
  const RobotSettings core;
  CHECK(config.resolution_m == core.map.resolution_m);
  CHECK(config.local_bytes == core.map.storage_bytes);
  CHECK(config.scan_points == core.scan.points);
  CHECK(config.mode == number(core.inference.mode));
  CHECK(config.max_range_m == core.inference.max_range_m);
  CHECK(config.publisher_blocks == core.publisher.blocks);
  CHECK(config.tick_label_bytes == core.budget.label_bytes);
  CHECK(config.bytes_per_s == core.exchange.bytes_per_s);
  CHECK(config.answer_us == core.exchange.answer_us);
  CHECK(config.staged_bytes == core.global.staged_bytes);
  CHECK(config.edge == number(core.global.diffusion.edge));
  CHECK(config.work_per_tick == core.work_per_tick);
  CHECK(config.reserved == 0);
  RobotSettings made = core;
  made.global.map.tuple = TuplePolicy::kCompact;
  std::uint64_t bytes = 0;
  REQUIRE(tessera_required_bytes(&config, 19, &bytes) == TESSERA_OK);
  CHECK(bytes > Robot::required_bytes(made, 21));
  // The handle, its buffer for files, and a block as searches read it.
  CHECK(bytes < Robot::required_bytes(made, 21) + MapReader::most_snapshot_bytes(21) + 16384);
}

TEST_CASE("C interface: the number of contributions is the replicas' too") {
  tessera_config config;
  REQUIRE(tessera_config_init(&config, sizeof(config)) == TESSERA_OK);
  RobotSettings core;
  std::uint64_t bytes = 0;
  REQUIRE(tessera_required_bytes(&config, 19, &bytes) == TESSERA_OK);
  const std::uint64_t beside = bytes - Robot::required_bytes(core, 21);
  for (const std::uint32_t contributions : {8U, 32U, 200U}) {
    config.contributions = core.exchange.contributions = core.global.replicas.contributions =
        contributions;
    REQUIRE(tessera_required_bytes(&config, 19, &bytes) == TESSERA_OK);
    CHECK(bytes - Robot::required_bytes(core, 21) == beside);
  }
}

}  // namespace
}  // namespace tessera

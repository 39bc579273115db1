// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How fast is a map saved, loaded and digested, without the disk?
#include "tessera/map/map_file.hpp"

#include <cstring>

#include "scenes.hpp"

namespace tessera::bench {

namespace {

/// A file in memory.
struct Bytes {
  std::vector<std::byte> bytes;
  std::size_t read = 0;

  ByteSink sink() {
    return {this, [](void* context, std::span<const std::byte> more) {
              auto& self = *static_cast<Bytes*>(context);
              self.bytes.insert(self.bytes.end(), more.begin(), more.end());
              return true;
            }};
  }
  ByteSource source() {
    return {this, [](void* context, std::span<std::byte> into) {
              auto& self = *static_cast<Bytes*>(context);
              const std::size_t n = std::min(into.size(), self.bytes.size() - self.read);
              if (n > 0) std::memcpy(into.data(), &self.bytes[self.read], n);
              self.read += n;
              return n;
            }};
  }
};

struct FileTimes {
  std::vector<double> save_ms;
  std::vector<double> load_ms;
  std::vector<double> digest_ms;
};

/// One round; false iff the map that was loaded is not the one that was saved.
Outcome<bool> round_trip(Mapper& mapper, Mapper& copy, Bytes& file, FileTimes& times) {
  MapFileBuffer buffer{};
  MapFileStatus status;
  const std::span<KeyedIndex> workspace = mapper.workspace();
  file.bytes.clear();
  file.read = 0;
  times.save_ms.push_back(
      1e3 * seconds_of([&] { status = save(mapper.map(), {}, workspace, buffer, file.sink()); }));
  if (!status.ok()) return Failure{status.what, FailureKind::kFailure};
  copy.map().clear();
  times.load_ms.push_back(1e3 * seconds_of([&] {
                            MapFileHeader header;
                            status = load_header(file.source(), buffer, header);
                            if (status.ok())
                              status = load_blocks(file.source(), header, buffer, copy.map());
                          }));
  if (!status.ok()) return Failure{status.what, FailureKind::kFailure};
  std::uint64_t digest = 0;
  times.digest_ms.push_back(1e3 * seconds_of([&] { digest = mapper.digest_of_map(); }));
  return digest == copy.digest_of_map();
}

Outcome<Json> measure(const Options& options, Records& records) {
  TESSERA_TRY_ASSIGN(const Scene scene, load_scene(options));
  Json modes = Json::object();
  for (const Mode& mode : {kMultiEntropyMode, kFreeSpaceMode}) {
    Outcome<Mapper> mapper = Mapper::make(mode, scene, options.resolution_m);
    Outcome<Mapper> copy = Mapper::make(mode, scene, options.resolution_m);
    if (!mapper.ok()) return mapper.failure();
    if (!copy.ok()) return copy.failure();
    TESSERA_TRY(mapper->integrate_all(scene));
    Bytes file;
    FileTimes times;
    for (int i = 0; i < options.repetitions; ++i) {
      TESSERA_TRY_ASSIGN(const bool same, round_trip(*mapper, *copy, file, times));
      if (!same) return Failure{"a loaded map differs from the saved one", FailureKind::kFailure};
    }
    Digest digest;
    for (const std::byte byte : file.bytes) digest.add(std::to_integer<std::uint64_t>(byte));
    records.check(std::string("file_") + mode.name, digest.value());
    modes[mode.name] = {{"title", mode.title},
                        {"bytes", file.bytes.size()},
                        {"voxels", observed_voxels(*mapper).size()},
                        {"save_ms", statistics(times.save_ms)},
                        {"load_ms", statistics(times.load_ms)},
                        {"digest_ms", statistics(times.digest_ms)}};
  }
  return Json{{"modes", modes}};
}

}  // namespace

}  // namespace tessera::bench

int main(int argc, char** argv) {
  return tessera::bench::run(argc, argv, "map_file", tessera::bench::measure);
}

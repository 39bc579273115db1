// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "list_marks.hpp"

#include <algorithm>

namespace tessera {

namespace {

bool by_version(const Description::Mark& a, const Description::Mark& b) noexcept {
  return a.version != b.version ? a.version < b.version : a.mark < b.mark;
}

}  // namespace

std::size_t list_marks(const HeldRecords& records, const HeldContribution& contribution,
                       const VersionSpan& span, std::uint32_t& last,
                       std::span<Description::Mark> into, std::size_t& visited) noexcept {
  const auto first = static_cast<std::uint32_t>(span.first());
  last = static_cast<std::uint32_t>(std::min<std::uint64_t>({span.last(), last, kLastVersion}));
  // Of the first version there may be more blocks than fit: they never leave the list.
  Description::Mark& of_first = into.front();
  bool has_first = false;
  const std::span<Description::Mark> later = into.subspan(1);
  std::size_t count = 0;
  // Of later versions the first count, a heap with the latest on top.
  const auto heap = [&] { return later.first(count); };
  visited += contribution.index.visit(
      records.links(), {first, last},
      [&](std::uint32_t number) {
        const Replicas::Replica& part = records.replicas().record(number);
        if (part.version < first || part.version > last) return;
        const Description::Mark one{part.version, mark_of(part.hash, part.live)};
        if (one.version == first) {
          of_first = {first, has_first ? mark_of_both(of_first.mark, one.mark) : one.mark};
          has_first = true;
          return;
        }
        if (count == later.size()) {
          std::pop_heap(heap().begin(), heap().end(), by_version);
          --count;
          last = later[count].version - 1;
          if (one.version > last) return;
        }
        later[count++] = one;
        std::push_heap(heap().begin(), heap().end(), by_version);
      },
      [](std::uint32_t) { return true; });
  std::sort_heap(heap().begin(), heap().end(), by_version);
  while (count != 0 && later[count - 1].version > last) --count;
  std::size_t listed = has_first ? 1 : 0;
  for (const Description::Mark one : heap()) {
    if (listed != 0 && into[listed - 1].version == one.version) {
      into[listed - 1].mark = mark_of_both(into[listed - 1].mark, one.mark);
    } else {
      into[listed++] = one;
    }
  }
  return listed;
}

}  // namespace tessera

// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The numbers of the exchange's report, each written once: kind, type, name, sentence
// (base/counters.hpp). Also for C, whose struct has them in this order: append 64-bit ones.
#pragma once

/// How the exchange stands.
#define TESSERA_EXCHANGE_STATE(ROW)                                                     \
  ROW(LEVEL, uint32_t, contributions, "Contributions known, the own ones included.")    \
  ROW(LEVEL, uint32_t, complete, "Of these, those that hold what their origin states.") \
  ROW(LEVEL, uint32_t, peers, "Robots in the table of peers.")

/// What it received, what was in it, and what it sent. None ever decreases.
#define TESSERA_EXCHANGE_COUNTERS(ROW)                                                             \
  ROW(COUNTER, uint64_t, received,                                                                 \
      "Datagrams received; each refused one is counted once more below.")                          \
  ROW(COUNTER, uint64_t, received_bytes, "Their bytes.")                                           \
  ROW(COUNTER, uint64_t, refused_size, "Shorter than a header and a tag, or too long.")            \
  ROW(COUNTER, uint64_t, refused_format, "No header of this format.")                              \
  ROW(COUNTER, uint64_t, refused_tag, "Damaged, or from a sender without the key.")                \
  ROW(COUNTER, uint64_t, refused_signature, "Not signed by the robot that it names.")              \
  ROW(COUNTER, uint64_t, refused_configuration,                                                    \
      "Another resolution, class table, scale or policy.")                                         \
  ROW(COUNTER, uint64_t, refused_replay, "Received before, or of a session that is over.")         \
  ROW(COUNTER, uint64_t, refused_robot, "Another process with this robot's number.")               \
  ROW(COUNTER, uint64_t, refused_excluded, "Of a robot that is excluded.")                         \
  ROW(COUNTER, uint64_t, refused_peers, "No place in the table of peers.")                         \
  ROW(COUNTER, uint64_t, refused_body, "A valid tag, but not a body of its kind.")                 \
  ROW(COUNTER, uint64_t, own_echoes, "Sent by this process itself.")                               \
  ROW(COUNTER, uint64_t, records_taken, "Records that are new here.")                              \
  ROW(COUNTER, uint64_t, records_stale, "Records that are known, or older than what is known.")    \
  ROW(COUNTER, uint64_t, records_refused,                                                          \
      "Records without room, or beyond the robot's share: requested again later.")                 \
  ROW(COUNTER, uint64_t, records_early, "Chunks of contributions whose frame is not known yet.")   \
  ROW(COUNTER, uint64_t, refused_contributions,                                                    \
      "Times that there was no place for another contribution.")                                   \
  ROW(COUNTER, uint64_t, displaced_contributions, "Contributions whose place another one took.")   \
  ROW(COUNTER, uint64_t, diverged, "Times that a comparison of contents was begun.")               \
  ROW(COUNTER, uint64_t, impostors, "Claims that this robot said what it did not.")                \
  ROW(COUNTER, uint64_t, sent, "Datagrams sent.")                                                  \
  ROW(COUNTER, uint64_t, sent_bytes, "Their bytes.")                                               \
  ROW(COUNTER, uint64_t, announcements, "Announcements sent.")                                     \
  ROW(COUNTER, uint64_t, requests, "Requests sent.")                                               \
  ROW(COUNTER, uint64_t, requests_saved,                                                           \
      "Requests not sent, as another robot requested the same.")                                   \
  ROW(COUNTER, uint64_t, frames, "Frames of contributions sent.")                                  \
  ROW(COUNTER, uint64_t, fresh_chunks, "Chunks of new content sent.")                              \
  ROW(COUNTER, uint64_t, answer_chunks, "Chunks sent as answers.")                                 \
  ROW(COUNTER, uint64_t, answer_bytes, "Of sent_bytes: what others asked for.")                    \
  ROW(COUNTER, uint64_t, answers_saved, "Answers not sent, as another robot gave the same.")       \
  ROW(COUNTER, uint64_t, refused_answers, "Requests for which there was no place.")                \
  ROW(COUNTER, uint64_t, published_parts, "Parts of blocks published.")                            \
  ROW(COUNTER, uint64_t, refused_parts,                                                            \
      "Parts of blocks that could not be published for lack of room.")                             \
  ROW(LEVEL, uint32_t, waiting_answers, "Answers that wait to be sent.")                           \
  ROW(RESERVED, uint32_t, reserved, "")                                                            \
  ROW(COUNTER, uint64_t, refused_mission, "Of another mission.")                                   \
  ROW(COUNTER, uint64_t, refused_rate, "More signed messages than one robot may send.")            \
  ROW(COUNTER, uint64_t, ended_contributions,                                                      \
      "Contributions removed, as their origin no longer counts them.")                             \
  ROW(COUNTER, uint64_t, refused_epochs, "Times that something below its robot's floor came.")     \
  ROW(COUNTER, uint64_t, frames_early, "Revisions of frames that came too soon.")                  \
  ROW(COUNTER, uint64_t, conflicts,                                                                \
      "Times that two contents of one version, or of one moment, were found: by a proof, or in a " \
      "fleet that does not sign by one that replaced the other.")                                  \
  ROW(COUNTER, uint64_t, twins, "Times that a peer's number was used by two processes.")           \
  ROW(COUNTER, uint64_t, statements, "Statements sent.")                                           \
  ROW(COUNTER, uint64_t, descriptions, "Descriptions sent.")                                       \
  ROW(COUNTER, uint64_t, conflict_proofs,                                                          \
      "Proofs of conflicts that were found or received, one for each epoch of a robot.")           \
  ROW(COUNTER, uint64_t, refused_disputed,                                                         \
      "Times that something came of an epoch that a proof ended.")                                 \
  ROW(LEVEL, uint32_t, banned, "Robots that three proofs exclude.")                                \
  ROW(LEVEL, uint32_t, far_contributions,                                                          \
      "Contributions known of which no records are wanted, as they are far.")                      \
  ROW(COUNTER, uint64_t, far_chunks, "Chunks of far contributions received, and not taken.")       \
  ROW(COUNTER, uint64_t, made_far,                                                                 \
      "Times that all records of a contribution were dropped, as it is far.")                      \
  ROW(COUNTER, uint64_t, made_near, "Times that a far contribution was wanted again.")             \
  ROW(COUNTER, uint64_t, refused_far, "Times that a contribution could not become a far one.")     \
  ROW(COUNTER, uint64_t, forgotten_far,                                                            \
      "Far contributions that were forgotten, as all places of far ones were taken.")              \
  ROW(COUNTER, uint64_t, presences, "Times that this robot's place was sent.")                     \
  ROW(COUNTER, uint64_t, presences_taken, "Places of other robots that were taken.")               \
  ROW(COUNTER, uint64_t, refused_presences,                                                        \
      "Places of others that were not: too large a body, a stamp before the one before, or more "  \
      "robots than there is room for.")

// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The names of the counters of the exchange, for all reports.
#pragma once

#include "tessera/exchange/exchange_config.hpp"

namespace tessera {

/// Calls visit(name, value) for each number of a report, in order.
template <class Visit>
void for_counters(const ExchangeReport& report, Visit&& visit) {
  visit("received", report.received);
  visit("received_bytes", report.received_bytes);
  visit("refused_size", report.refused_size);
  visit("refused_format", report.refused_format);
  visit("refused_tag", report.refused_tag);
  visit("refused_signature", report.refused_signature);
  visit("refused_configuration", report.refused_configuration);
  visit("refused_replay", report.refused_replay);
  visit("refused_robot", report.refused_robot);
  visit("refused_excluded", report.refused_excluded);
  visit("refused_peers", report.refused_peers);
  visit("refused_body", report.refused_body);
  visit("own_echoes", report.own_echoes);
  visit("records_taken", report.records_taken);
  visit("records_stale", report.records_stale);
  visit("records_refused", report.records_refused);
  visit("records_early", report.records_early);
  visit("refused_contributions", report.refused_contributions);
  visit("displaced_contributions", report.displaced_contributions);
  visit("diverged", report.diverged);
  visit("impostors", report.impostors);
  visit("refused_mission", report.refused_mission);
  visit("refused_rate", report.refused_rate);
  visit("ended_contributions", report.ended_contributions);
  visit("refused_epochs", report.refused_epochs);
  visit("frames_early", report.frames_early);
  visit("conflicts", report.conflicts);
  visit("conflict_proofs", report.conflict_proofs);
  visit("refused_disputed", report.refused_disputed);
  visit("banned", report.banned);
  visit("twins", report.twins);
  visit("statements", report.statements);
  visit("descriptions", report.descriptions);
  visit("sent", report.sent);
  visit("sent_bytes", report.sent_bytes);
  visit("announcements", report.announcements);
  visit("requests", report.requests);
  visit("requests_saved", report.requests_saved);
  visit("frames", report.frames);
  visit("fresh_chunks", report.fresh_chunks);
  visit("answer_chunks", report.answer_chunks);
  visit("answer_bytes", report.answer_bytes);
  visit("answers_saved", report.answers_saved);
  visit("refused_answers", report.refused_answers);
  visit("published_parts", report.published_parts);
  visit("refused_parts", report.refused_parts);
  visit("contributions", report.contributions);
  visit("complete", report.complete);
  visit("peers", report.peers);
  visit("waiting_answers", report.waiting_answers);
}

}  // namespace tessera

# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""What an attack has left: the differences between what robots report and what they must hold."""
from team import held

CONTRIBUTIONS_PER_ROBOT = 4


def effects(reports, published, quota_of=None, nobody_may_stay=False):
    """One line for each effect in the reports of honest robots. published: of each of them, what it holds of its own where nobody
    attacks, whichever epoch it says it in. quota_of: a robot that may hold what one robot may. nobody_may_stay: robots that do not exist may have places."""
    found = []
    own_digests = {report["robot"]: (held(report, report["robot"], report["epoch"]) or {}).get("digest") for report in reports}
    for report in reports:
        here = f"robot {report['robot']}"
        for origin in reports:
            contribution = held(report, origin["robot"], origin["epoch"])
            if contribution is None:
                found.append(f"{here} holds nothing of robot {origin['robot']}")
            elif content_of(contribution) != content_of(published[origin["robot"]]) or contribution["digest"] != own_digests[origin["robot"]]:
                found.append(f"{here} holds another content of robot {origin['robot']} than that published")
            elif frame_of(contribution) != frame_of(published[origin["robot"]]):
                found.append(f"{here} has another frame of robot {origin['robot']} than that published")
        found += [f"{here} {what}" for what in wrong_names(report, reports, quota_of, nobody_may_stay)]
        found += [f"{here} takes robot {robot} for gone" for robot in report["left"] if robot in published]
        if report["parts"] != sum(name["records"] for name in report["names"]):
            found.append(f"{here} keeps {report['parts']} parts of blocks and counts others")
    return found


def content_of(contribution):
    return [contribution[what] for what in ("blocks", "label_evidence", "passes")]


def frame_of(contribution):
    return contribution["frame_revision"], contribution["a_point"]


def wrong_names(report, reports, quota_of, nobody_may_stay):
    epochs = {other["robot"]: other["epoch"] for other in reports}
    of_member = [name for name in report["names"] if name["robot"] == quota_of]
    if len(of_member) > CONTRIBUTIONS_PER_ROBOT:
        yield f"has given robot {quota_of} {len(of_member)} places"
    for name in report["names"]:
        if name["robot"] in epochs:
            if name["epoch"] != epochs[name["robot"]]:
                yield f"has given a place to epoch {name['epoch']} of robot {name['robot']}, which does not count"
            elif not name["complete"]:
                yield f"says that it lacks something of robot {name['robot']}"
        elif name["robot"] != quota_of and not nobody_may_stay:
            yield f"has given a place to robot {name['robot']}, which nobody is"

# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""The tables of docs/measured/alignment.md."""
import sys

from judging import along_axes, is_within, reasons, spread, upper_limit
from markdown import table
from negatives import KINDS
from scenes import RECORDED, STREETS
from write_docs import fill


def rows_in_order(found):
    """Recorded scenes as they stand in RECORDED, then streets."""
    return [found["rows"][name] for name in (*RECORDED, *STREETS) if name in found["rows"]]


def share(part, whole):
    return f"{100.0 * part / whole:.1f} %"


def seeds_of(row):
    seeds = [trial["seed"] for trial in row["trials"]]
    return f"{min(seeds)}-{max(seeds)}"


def alignment_circumstances(found):
    at = found["circumstances"]
    rows = [("machine", f"{at['cpu']}, {at['cores']} cores, {at['memory_gb']} GB"), ("system", at["system"]), ("command", found["version"]),
            ("commit of the scripts, date", f"{at['commit']}, {at['date']}")]
    return table(("", "measured on"), rows)


def alignment_found(found):
    rows = []
    for row in rows_in_order(found):
        trials, bounds = row["trials"], row["bounds"]
        by_icp = share(sum(is_within(trial, bounds, "icp_") for trial in trials), len(trials)) if "icp_m" in trials[0] else "-"
        overlap = " to ".join(dict.fromkeys(f"{value:.2f}" for value in (min(row["overlap"]), max(row["overlap"]))))
        rows.append((row["title"], len(trials), seeds_of(row), overlap, share(sum(trial["accepted"] for trial in trials), len(trials)),
                     f"{bounds[0]:g} m, {bounds[1]:g} degrees",
                     share(sum(is_within(trial, bounds) for trial in trials), len(trials)), by_icp, sum(trial["false"] for trial in trials)))
    return table(("pairs", "trials", "seeds", "overlap", "found", "bounds", "within, by the poses", "within, by ICP", "false"), rows) if rows else None


def errors_of(found):
    """(row, trials that were accepted, prefix of what they are held against, its name)."""
    for row in rows_in_order(found):
        trials = [trial for trial in row["trials"] if trial["accepted"]]
        for against, said in (("", row["truth"]), ("icp_", "ICP")):
            if trials and against + "m" in trials[0]:
                yield row, trials, against, said


def alignment_errors(found):
    rows = [(row["title"], said, *(f"{x:.3f}" for x in spread([trial[against + "m"] for trial in trials])),
             *(f"{x:.2f}" for x in spread([trial[against + "deg"] for trial in trials]))) for row, trials, against, said in errors_of(found)]
    return table(("pairs", "against", "median, m", "95 %, m", "worst, m", "median, degrees", "95 %, degrees", "worst, degrees"), rows) if rows else None


def alignment_axes(found):
    """In A's frame, which is the same in all trials of a row."""
    rows = [(row["title"], said, *(f"{mean:+.3f} ({deviation:.3f})" for mean, deviation in
                                   along_axes([trial[against + "off_m"] for trial in trials]))) for row, trials, against, said in errors_of(found)]
    return table(("pairs", "against", "mean along x (deviation), m", "y, m", "z, m"), rows) if rows else None


def alignment_sigmas(found):
    """Errors by the deviation that is stated of the direction least held."""
    rows = []
    for row, trials, against, said in errors_of(found):
        cells = []
        for unit, digits in (("m", 3), ("deg", 2)):
            ratios = spread([trial[against + unit] / trial["sigma_" + unit] for trial in trials])
            cells += [f"{spread([trial['sigma_' + unit] for trial in trials])[0]:.{digits}f}", f"{ratios[0]:.1f}", f"{ratios[1]:.1f}"]
        rows.append((row["title"], said, *cells))
    return table(("pairs", "against", "sigma, median, m", "error / sigma, median", "95 %", "sigma, median, degrees", "error / sigma, median", "95 %"),
                 rows) if rows else None


def alignment_icp(found):
    rows = [(row["title"], f"{row['poses_against_icp'][0]:.3f}", f"{row['poses_against_icp'][1]:.2f}")
            for row in rows_in_order(found) if "poses_against_icp" in row]
    return table(("poses of both halves, by ICP of their points", "m", "degrees"), rows) if rows else None


def alignment_costs(found):
    groups = [(row["title"], row["trials"]) for row in rows_in_order(found)]
    if "negatives" in found:
        groups.append(("different places", found["negatives"]["pairs"]))
    rows = [(title, *(f"{x:.2f}" for x in spread([trial["cpu_s"] for trial in trials]))) for title, trials in groups]
    return table(("CPU of a call, reading both maps included", "median, s", "95 %, s", "worst, s"), rows) if rows else None


def alignment_negatives(found):
    if "negatives" not in found:
        return None
    pairs, rows = found["negatives"]["pairs"], []
    for kind in (*KINDS, "all"):
        of_kind = [pair for pair in pairs if kind in (pair["kind"], "all")]
        if of_kind:
            accepted = sum(pair["accepted"] for pair in of_kind)
            rows.append((kind, len(of_kind), accepted, f"{100.0 * upper_limit(accepted, len(of_kind)):.2f} %"))
    return table(("different places", "pairs", "accepted", "upper 95 % limit"), rows)


def alignment_reasons(found):
    groups = [(row["title"], row["trials"]) for row in rows_in_order(found)]
    if "negatives" in found:
        groups.append(("different places", found["negatives"]["pairs"]))
    rows = []
    for title, trials in groups:
        accepted = [trial["support"] for trial in trials if trial["accepted"]]
        if accepted:
            rows.append((title, "found", len(accepted), f"{min(accepted):,.0f} to {max(accepted):,.0f}"))
        for reason, (count, most) in reasons(trials).items():
            rows.append((title, f"refused: {reason}", count, f"at most {most:,.0f}"))
    return table(("pairs", "answer", "number", "support, samples"), rows) if rows else None


def alignment_fused(found):
    if "fused" not in found:
        return None
    rows = []
    for key, said in (("found", "unknown"), ("near", "10 degrees and 5 m off at first")):
        trials = [trial[key] for trial in found["fused"]["trials"]]
        lost = sorted(trial["found"] - trial["exact"] for trial in trials)
        exact = sum(trial["exact"] for trial in trials) / len(trials)
        rows.append((said, len(trials), f"{exact:.2f}", f"{exact + sum(lost) / len(lost):.2f}", f"{sum(lost) / len(lost):+.2f}", f"{lost[0]:+.2f}"))
    return table(("frame of the second half", "trials", "mean IoU in exact frames, %", "in found ones, %", "lost, points", "worst"), rows)


SAID = {"tessera": "`tessera align`", "icp": "point-to-plane ICP", "gicp": "GICP", "fpfh": "FPFH, sample consensus, GICP"}


def alignment_others(found):
    """Each cell: within bounds, false, median seconds."""
    if "others" not in found:
        return None
    rows = []
    for row in found["others"]:
        trials = row["trials"]
        cells = []
        for method in SAID:
            of = [trial[method] for trial in trials]
            within = sum(trial["within"] for trial in of)
            cells.append(f"{within}, {sum(trial['right'] for trial in of) - within}, {sum(trial['false'] for trial in of)}; "
                         f"{spread([trial['cpu_s'] for trial in of])[0]:.1f} s")
        rows.append((row["title"], len(trials), *cells))
    return table(("pairs", "trials", *SAID.values()), rows)


def alignment_margin(found):
    """How far what was accepted and what was refused lie apart."""
    true = [trial for row in rows_in_order(found) for trial in row["trials"] if trial["accepted"] and not trial["false"]]
    if not true or "negatives" not in found:
        return None
    refused = [pair for pair in found["negatives"]["pairs"] if not pair["accepted"]]
    least, most = min(true, key=lambda trial: trial["support"]), max(refused, key=lambda pair: pair["support"])
    return table(("", "support, samples", "share that agrees"), [
        ("least support of a true pair that was accepted", f"{least['support']:,.0f}", share(least["share"], 1)),
        (f"largest support of a refused pair of different places ({most['a']}, {most['b']}; {most['reason']})",
         f"{most['support']:,.0f}", share(most["share"], 1))])


TABLES = {f.__name__: f for f in (alignment_circumstances, alignment_icp, alignment_found, alignment_errors, alignment_axes, alignment_sigmas,
                                  alignment_negatives, alignment_reasons, alignment_margin, alignment_fused, alignment_others, alignment_costs)}


def write(found, page):
    text, used = fill(page.read_text(), found, TABLES)
    page.write_text(text)
    missing = sorted(set(TABLES) - set(used))
    if missing:
        sys.exit(f"alignment.py: the page has no place for {', '.join(missing)}")

#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""write_page.py EXPERIMENTS_JSON PAGE: puts the figures into the page (docs/measured/experiments.md), as bench/write_docs.py does."""
import json
import pathlib
import sys

sys.path.append(str(pathlib.Path(__file__).resolve().parent.parent))

import requirements  # noqa: E402
import table_two as two  # noqa: E402  these need the path above
import teams  # noqa: E402
import weighted_labels as weighted  # noqa: E402
from markdown import number, paragraph, table  # noqa: E402
from write_docs import fill  # noqa: E402

NAMES = {"counting_a": "counting, local A", "counting_b": "counting, local B", "counting_none": "counting, `none`",
         "local_a": "local A", "local_b": "local B", "resampled": "local A alone, in the global frame",
         "together": "one map of all scans",
         "none": "global, `none`", "paper": "global, `paper`", "contractive": "global, `contractive`"}


def percent(value, digits=2):
    return f"{100.0 * value:.{digits}f}"


def variance_of(fused, key="mean_variance"):
    return f"{1e4 * fused[key]:.1f}"


def circumstances(found):
    at = found["circumstances"]
    rows = [("machine", f"{at['cpu']}, {at['cores']} cores, {at['memory_gb']} GB"), ("system", at["system"]),
            ("compiler", found["compiler"]), ("command", found["version"]),
            ("commit of the scripts, date", f"{at['commit']}, {at['date']}"), ("plan", found["plan"])]
    return table(("", "measured on"), rows)


def required(found):
    return table(("what", "asked", "measured", "met"), requirements.of(found))


def real_classes(found):
    if "table_two" not in found:
        return None
    rows = found["table_two"]["rows"]
    labels = sorted(rows["none"]["iou"], key=lambda label: -rows["none"]["input_iou"][label])
    lines = [("input", *(percent(rows["none"]["input_iou"][label], 1) for label in labels),
              f"**{percent(rows['none']['input_mean_iou'])}**")]
    for name in rows:
        lines.append((NAMES[name], *(percent(rows[name]["iou"].get(label, 0.0), 1) for label in labels),
                      f"**{percent(rows[name]['mean_iou'])}**"))
    return table(("IoU, %", *labels, "mean"), lines)


def real_summary(found):
    if "table_two" not in found:
        return None
    rows, fused = found["table_two"]["rows"], found["table_two"]["fused"]
    lines = []
    for name, of in two.verdict(rows).items():
        lines.append((NAMES[name], f"{of['gain']:+.2f}", f"{of['by_diffusion']:+.2f}", f"{of['over_best_local']:+.2f}",
                      requirements.of_class(of["worst_loss"]) if name != "none" else "-",
                      f"{rows[name]['calibration_error']:.3f}", variance_of(fused[name]),
                      f"{fused[name]['voxels']:,}", f"{fused[name]['milliseconds']:,.0f}"))
    said = ", ".join(f"{NAMES[name]} {rows[name]['calibration_error']:.3f}" for name in ("local_a", "local_b"))
    changed = found["table_two"]["unobserved"]
    head = ("points of mIoU", "over the input", "over `none`", "over the better local", "largest loss of a class",
            "calibration error", "mean variance, 1e-4", "label voxels", "ms to fuse")
    new = "; ".join(f"`{name}` {sum(of.values()):,}, of which {of['unknown']} had not been observed and {of['free']:,} were free"
                    for name, of in changed.items())
    return table(head, lines) + "\n\n" + paragraph(f"Calibration error of the local maps: {said}. Voxels that are occupied with a label "
                                                  f"in a diffused map and not in `none`: {new}.")


def paper_two(found):
    head = ("mean IoU, %", "input", "OctoMap local", "earlier fusion", "local", "global", "global over input", "global over local")

    def line(name, values):
        return (name, *(f"{value:.2f}" for value in values), f"{values[4] - values[0]:+.2f}", f"{values[4] - values[3]:+.2f}")
    lines = [line(f"paper, sequence {name}", values) for name, values in two.PAPER.items()]
    if "table_two" in found:
        rows = found["table_two"]["rows"]

        def best(kind):
            return max(rows[f"{kind}_a"]["mean_iou"], rows[f"{kind}_b"]["mean_iou"])
        ours = (rows["none"]["input_mean_iou"], best("counting"), rows["counting_none"]["mean_iou"], best("local"),
                rows["contractive"]["mean_iou"])
        lines.append(line("here, sequence 08, scans 0-5", [100.0 * value for value in ours]))
    return table(head, lines)


def pairs(found):
    lines = []
    for pair in found["pairs"]:
        rows = pair["rows"]
        for name in ("local_a", "resampled", "local_b", "together", *two.METHODS):
            of = rows[name]
            fuse = of.get("fuse")
            lines.append((f"{pair['seed']}, {pair['scans']}", NAMES[name], percent(of["mean_iou"]),
                          percent(of["iou"].get("road", 0.0), 1), percent(of["accuracy"]), percent(of["coverage"]),
                          f"{of['calibration_error']:.3f}",
                          variance_of(fuse) if fuse and name in two.METHODS else "-"))
    return table(("seed, scans", "map", "mIoU, %", "road, IoU %", "accuracy, %", "coverage, %", "calibration error",
                  "mean variance, 1e-4"), lines)


def variance(found):
    lines = []
    for scene in found["teams"]:
        for team in scene["teams"]:
            fused = team["fused"]
            local = [f"{1e4 * value:.1f}" for value in team.get("local_variances", [])]
            undiffused = variance_of(fused["paper"], "mean_variance_undiffused")
            lines.append((scene["seed"], team["robots"], " and ".join(local) or "-",
                          *(variance_of(fused[name]) for name in ("none", "contractive", "paper")), undiffused))
    return table(("mean variance, 1e-4: seed", "robots", "local maps", "`none`", "`contractive`", "`paper`",
                  "`paper`, undiffused"), lines)


def borders(found):
    lines = []
    for scene in found["teams"]:
        for team in scene["teams"]:
            for pair in team["pairs"]:
                a, b = pair["robots"]
                errors = " / ".join(f"{pair[name]['calibration_error']:.3f}" for name in ("local_a", "local_b", "contractive"))
                lines.append((scene["seed"], team["robots"], f"{a} and {b}", f"{pair['none']['points']:,}",
                              percent(pair["none"]["input_mean_iou"], 1),
                              *(percent(pair[name]["mean_iou"], 1) for name in ("local_a", "local_b", *two.METHODS)), errors))
    return table(("seed", "team of", "robots", "points", "input", "first", "second", "`none`", "`paper`", "`contractive`",
                  "calibration error: first / second / `contractive`"), lines)


def everywhere(found):
    lines = []
    for scene in found["teams"]:
        for team in scene["teams"]:
            of = team["all"]
            lines.append((scene["seed"], team["robots"], percent(of["none"]["input_mean_iou"], 1),
                          *(percent(of[name]["mean_iou"], 1) for name in two.METHODS), percent(of["contractive"]["coverage"], 1),
                          *(f"{of[name]['calibration_error']:.3f}" for name in two.METHODS),
                          len(team["fused"]["none"]["warnings"])))
    return table(("seed", "robots", "input, mIoU %", "`none`", "`paper`", "`contractive`", "coverage, %",
                  "calibration error: `none`", "`paper`", "`contractive`", "pairs that `fuse` warns of"), lines)


def efficiency(found):
    lines = []
    for scene in found["teams"]:
        for team in scene["teams"]:
            of = team["efficiency"]
            count = team["robots"]
            lines.append((scene["seed"], count, f"{max(of['driven_s']):.1f}", f"{sum(of['local_m3']) / count:,.0f}",
                          f"{of['global_m3']:,.0f}", f"{sum(of['local_m3_per_s']) / count:.0f}", f"{of['global_m3_per_s']:.0f}",
                          f"**{of['times_one_robot']:.2f}**", f"{of['times_one_robot'] / count:.2f}",
                          f"**{of['global_m3_per_s'] / teams.alone(scene):.2f}**",
                          f"{max(of['worked_s']):.1f} + {of['fuse_s']:.1f}", f"{of['times_one_robot_worked']:.2f}"))
    return table(("seed", "robots", "driven, s", "a local map, m3", "global, m3", "a robot, m3/s", "team, m3/s",
                  "times its local maps", "a robot", "times one alone", "computed: a robot + fusing, s",
                  "times its local maps, computed"), lines)


def two_studies(found, part, each):
    """each(study) gives rows; both scenes in one table."""
    return [(name, *row) for name, study in found[part].items() for row in each(study)]


def places(found):
    def each(study):
        right, merged = study["right"], {}
        for row in study["places"]:
            merged.setdefault((row["kind"], row["amount"]), []).append(row)
        local = percent(max(part["mean_iou"] for part in right["locals"]))
        yield ("right", "-", local, percent(right["none"]["mean_iou"]), percent(right["contractive"]["mean_iou"]),
               percent(right["contractive"]["fuse"]["alignment"], 1), "-")
        for (kind, amount), rows in merged.items():
            count = len(rows)
            mean = {name: sum(row[name]["mean_iou"] for row in rows) / count for name in ("none", "contractive")}
            alignment = sum(row["none"]["fuse"]["alignment"] for row in rows) / count
            yield (f"{amount:g} " + ("m" if kind == "metres" else "degrees"), count, local, percent(mean["none"]),
                   percent(mean["contractive"]), percent(alignment, 1),
                   f"{sum(row['none']['fuse']['warned'] for row in rows)} of {count}")
    return table(("scene", "error", "directions", "better local, mIoU %", "`none`", "`contractive`", "alignment, %", "warned"),
                 two_studies(found, "robustness", each))


def labels(found):
    def each(study):
        noise = ((f"{100 * row['share']:g} %, {row['who']}", row) for row in study["noise"])
        for name, row in (("0 %", study["right"]), *noise, ("swapped, one", study["swapped"])):
            fused = row["contractive"]
            yield (name, *(percent(part["mean_iou"]) for part in row["locals"]), percent(row["none"]["mean_iou"]),
                   percent(fused["mean_iou"]), f"{100 * (fused['mean_iou'] - row['locals'][0]['mean_iou']):+.2f}",
                   f"{fused['calibration_error']:.3f}", percent(fused["fuse"]["alignment"], 1),
                   "yes" if fused["fuse"]["warned"] else "no")
    return table(("scene", "wrong labels", "local A, mIoU %", "local B", "`none`", "`contractive`", "over local A",
                  "calibration error", "alignment, %", "warned"), two_studies(found, "robustness", each))


def settings_row(found):
    if found is None:
        return ("refused",) + ("-",) * 5
    return (f"{found['by_diffusion']:+.2f}", requirements.of_class(found["worst_loss"]), f"{found['calibration_error']:.3f}",
            f"{1e4 * found['mean_variance']:.0f}", number(found["residual"]), f"{found['milliseconds']:,.0f}")


SETTINGS_HEAD = ("over `none`", "largest loss of a class", "calibration error", "mean variance, 1e-4", "residual", "ms")


def grid(found):
    def each(study):
        for n in sorted({row["iterations"] for row in study["grid"]}):
            cells = [row["found"] for row in study["grid"] if row["iterations"] == n]
            yield (n, *("refused" if cell is None else f"{cell['by_diffusion']:+.2f} ({cell['worst_loss'][1]:+.2f})"
                        for cell in cells))
    lengths = list(dict.fromkeys(row["length"] for study in found["diffusion"].values() for row in study["grid"]))
    return table(("scene", "iterations", *(f"D = {length:g} voxels" for length in lengths)),
                 two_studies(found, "diffusion", each))


def settings(found):
    def each(study):
        yield ("`none`", *settings_row(study["none"]))
        for row in study["grid"]:
            if row["length"] == 2.0:
                yield (f"n = {row['iterations']}", *settings_row(row["found"]))
        for row in study["alpha"]:
            yield (f"alpha = {row['alpha']:g}", *settings_row(row["found"]))
        for row in study["edge"]:
            yield (f"`--edge {row['edge']}`", *settings_row(row["found"]))
        for row in study["paper"]:
            yield (f"`paper`, n = {row['iterations']}", *settings_row(row["found"]))
        yield ("`--whole-map`", *settings_row(study["whole_map"]))
    return table(("scene", "setting", *SETTINGS_HEAD), two_studies(found, "diffusion", each))


def weighted_labels(found):
    lines = []
    for row in found["weighted_labels"]:
        for name, gain, *errors in weighted.gains(row):
            lines.append((f"{row['seed']}, {row['scans']}", NAMES[name], percent(row["best"]["rows"][name]["mean_iou"]),
                          percent(row["three"]["rows"][name]["mean_iou"]), f"{gain:+.2f}", *(f"{error:.3f}" for error in errors)))
    costs = [(row["three"]["scan_ms"] / row["best"]["scan_ms"], row["three"]["used_bytes"] / row["best"]["used_bytes"])
             for row in found["weighted_labels"]]
    head = ("seed, scans", "map", "best label, mIoU %", "three", "points", "calibration error, best", "three", "Brier score, best",
            "three")
    said = ", ".join(f"{time:.2f} and {memory:.3f}" for time, memory in costs)
    return table(head, lines) + "\n\n" + paragraph(f"Three labels over one, time of a scan and bytes of the local maps: {said}.")


TABLES = {f.__name__: f for f in (circumstances, required, real_classes, real_summary, paper_two, pairs, variance, borders,
                                  everywhere, efficiency, places, labels, grid, settings, weighted_labels)}


def main():
    found = json.loads(pathlib.Path(sys.argv[1]).read_text())
    page = pathlib.Path(sys.argv[2])
    text, used = fill(page.read_text(), found, TABLES)
    page.write_text(text)
    missing = sorted(set(TABLES) - set(used))
    if missing:
        sys.exit(f"write_page.py: the page has no place for {', '.join(missing)}")


if __name__ == "__main__":
    main()

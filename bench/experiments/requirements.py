# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""What is asked of the global map, and whether it is so."""
import table_two
import teams

LEAST_GAIN, LEAST_BY_DIFFUSION, MOST_LOSS, LEAST_OVER_LOCAL, LEAST_TIMES = 2.0, 0.5, -1.0, 5.0, 3.4


def row(what, asked, measured, met):
    return what, asked, measured, "yes" if met else "**no**"


def of_class(item):
    return f"{item[0]} {item[1]:+.2f}"


def real(found):
    of = table_two.verdict(found["table_two"]["rows"])["contractive"]
    unknown = found["table_two"]["unobserved"]["contractive"]["unknown"]
    scene, loss, least = "real pair: ", of["worst_loss"], of["least_over_worse_local"]
    return [row(scene + "mIoU over the better local map", "above 0", f"{of['over_best_local']:+.2f}", of["over_best_local"] > 0),
            row(scene + "mIoU over `none`", f"{LEAST_BY_DIFFUSION:+.1f}", f"{of['by_diffusion']:+.2f}",
                of["by_diffusion"] >= LEAST_BY_DIFFUSION),
            row(scene + "mIoU over the input", f"{LEAST_GAIN:+.1f}, aim +3", f"{of['gain']:+.2f}", of["gain"] >= LEAST_GAIN),
            row(scene + "largest loss of a class to diffusion", f"{MOST_LOSS:+.1f}, aim -0.3", of_class(loss),
                loss[1] >= MOST_LOSS),
            row(scene + "a class against the worse local map, the least", "0 or more", of_class(least), least[1] >= 0),
            row(scene + "labels where nobody had observed anything", "0 voxels", f"{unknown}", unknown == 0)]


def over_local(rows):
    """Global mIoU less the better local one, in points; the global map's calibration error, and the local maps'."""
    locals_ = [rows["local_a"], rows["local_b"]]
    gain = 100.0 * (rows["contractive"]["mean_iou"] - max(part["mean_iou"] for part in locals_))
    return gain, rows["contractive"]["calibration_error"], [part["calibration_error"] for part in locals_]


def simulated(scene, rows):
    gain, error, local_errors = over_local(rows)
    allowed = "at most " + " and ".join(f"{e:.3f}" for e in local_errors) + ", the locals'"
    return [row(f"{scene}: mIoU over the better local map", f"{LEAST_OVER_LOCAL:+.1f}", f"{gain:+.2f}", gain >= LEAST_OVER_LOCAL),
            row(f"{scene}: calibration error", allowed, f"{error:.3f}", error <= min(local_errors))]


def team(scene, found, alone):
    """Over the borders between neighbours. alone: m3/s of a robot without a team."""
    each = [over_local(pair) for pair in found["pairs"]]
    name, count = f"{scene}, {found['robots']} robots", len(each)
    better = sum(error <= min(errors) for _, error, errors in each)
    rows = [row(f"{name}: mIoU over the better local map, each of {count} borders", f"{LEAST_OVER_LOCAL:+.1f}",
                ", ".join(f"{gain:+.1f}" for gain, _, _ in each), min(gain for gain, _, _ in each) >= LEAST_OVER_LOCAL),
            row(f"{name}: calibration error no worse than both locals'", f"at {count} borders", f"at {better}", better == count)]
    if found["robots"] == 4:
        for one, times in (("one of its local maps", found["efficiency"]["times_one_robot"]),
                           ("one robot that drives alone", found["efficiency"]["global_m3_per_s"] / alone)):
            rows.append(row(f"{name}: efficiency, times {one}", f"{LEAST_TIMES}", f"{times:.2f}", times >= LEAST_TIMES))
    return rows


def of(found):
    rows = real(found) if "table_two" in found else []
    for pair in found["pairs"]:
        rows += simulated(f"street {pair['seed']}, {pair['scans']} scans", pair["rows"])
    for scene in found["teams"]:
        for one in scene["teams"]:
            rows += team(f"long street {scene['seed']}", one, teams.alone(scene))
    return rows

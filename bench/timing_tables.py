# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""The tables of docs/measured/timing.md: what a unit of work costs, a robot's period worked out from it, and the worst cases."""
from markdown import number, table

# What the worked example takes for its robot: the simulated street's scanner of 16 beams, at 10 Hz.
PERIOD_MS = 100


def median(values):
    return sorted(values)[(len(values) - 1) // 2]


def mean(scans, key):
    return sum(scan[key] for scan in scans) / len(scans)


def unit_costs(found):
    """ns a return, a kernel evaluation and a ray step: differences between modes over the same scans."""
    modes = found["integrate"]["modes"]
    ms = {name: mode["cpu_ms"]["median"] for name, mode in modes.items()}
    points = mean(modes["counting"]["scans"], "points")
    entropy = mean(modes["multi_entropy"]["scans"], "evaluations")
    kernel = mean(modes["kernel"]["scans"], "evaluations")
    steps = mean(modes["multi_entropy_free_space"]["scans"], "ray_steps")
    return {"return": 1e6 * ms["counting"] / points,
            "multi_entropy": 1e6 * (ms["multi_entropy"] - ms["counting"]) / entropy,
            "kernel": 1e6 * (ms["kernel"] - ms["counting"]) / kernel,
            "ray_step": 1e6 * (ms["multi_entropy_free_space"] - ms["multi_entropy"]) / steps}


def costs(found):
    modes = found["integrate"]["modes"]
    cost = unit_costs(found)
    entropy, kernel, free = (modes[name]["scans"] for name in ("multi_entropy", "kernel", "multi_entropy_free_space"))
    rows = [("c_p", "a return: registered, thinned, sorted, counted", f"{cost['return']:.0f} ns",
             f"{mean(entropy, 'thinned') / mean(entropy, 'points'):.2f} thinned points a return"),
            ("c_e, multi-entropy", "an evaluation, its share of writing included", f"{cost['multi_entropy']:.1f} ns",
             f"{mean(entropy, 'evaluations') / mean(entropy, 'thinned'):.1f} a thinned point"),
            ("c_e, kernel of 3 voxels", "the same", f"{cost['kernel']:.1f} ns",
             f"{mean(kernel, 'evaluations') / mean(kernel, 'thinned'):.0f} a thinned point"),
            ("c_s", "a ray step, its share of carving included", f"{cost['ray_step']:.1f} ns",
             f"{mean(free, 'ray_steps') / mean(free, 'thinned'):.0f} a thinned point")]
    return table(("cost", "of", "time on a core", "how many there were"), rows)


def example(found):
    run = found["example"]
    cost = unit_costs(found)
    points, thinned, rays, evaluations, steps = (run[key] for key in ("points", "thinned", "rays", "kernel_evaluations", "ray_steps"))
    bound_evaluations = 7 * 8 * thinned
    bound_steps = rays * (run["max_range_m"] / run["resolution_m"] * 3**0.5 + 4)

    def ms(e, s):
        return 1e-6 * (cost["return"] * points + cost["multi_entropy"] * e + cost["ray_step"] * s)
    expected, bound = ms(evaluations, steps), ms(bound_evaluations, bound_steps)
    rows = [("points a scan", f"{points:,.0f}", f"{points:,.0f}"),
            ("n, thinned points", f"{thinned:,.0f}", f"{thinned:,.0f}"),
            ("rays", f"{rays:,.0f}", f"{rays:,.0f}"),
            ("evaluations", f"{evaluations:,.0f}", f"56 n = {bound_evaluations:,.0f}"),
            ("ray steps", f"{steps:,.0f}", f"rays (range / resolution * sqrt(3) + 4) = {bound_steps:,.0f}"),
            ("c_p points + c_e evaluations + c_s steps", f"{expected:.1f} ms", f"{bound:.0f} ms"),
            (f"of a period of {PERIOD_MS} ms", f"{expected / PERIOD_MS:.0%}", f"{bound / PERIOD_MS:.0%}"),
            ("measured: median, max of the scans", f"{run['median_ms']:.1f} ms, {run['max_ms']:.1f} ms", ""),
            ("scratch, map in use", f"{run['scratch_bytes'] / 1e6:.1f} MB, {run['used_bytes'] / 1e6:.1f} MB",
             f"`--memory {run['budget']}`: {run['budget_bytes'] / 1e6:.1f} MB"),
            ("left out", f"{run['left_out']:,}", "")]
    return table((f"{run['resolution_m']:g} m, {run['max_range_m']:g} m range, {run['scans']} scans", "as it is", "bound"), rows)


def worst_cases(found):
    rows = []
    for case in found["worst_cases"].values():
        operations, instructions = case["operations"], case["instructions"]
        rows.append((f"`{case['call']}`", case["input"], f"{case['formula']}: {case['bound']:,.0f}", f"{operations:,.0f}",
                     f"{instructions:,.0f}" if instructions else "-",
                     f"{instructions / operations:,.1f}" if instructions and operations else "-",
                     number(case["ns"] / 1e3), f"{case['stack_bytes']:,}" if case["stack_bytes"] else "-"))
    return table(("call", "input", "operations, at most", "counted", "instructions", "an operation", "\u00b5s", "stack, bytes"), rows)

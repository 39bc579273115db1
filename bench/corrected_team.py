#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""corrected_team.py --build FOLDER --drive FOLDER [--resolution M] [--loss SHARE] [--out FILE]: a drive as three robots that
each map a third of it, in submaps, with the odometry, while their pose graphs correct them and datagrams are lost.

The drive is a folder as for corrected_drive.py. All three drive at once; each is corrected ten times, by the optimised poses
of the scans that it has mapped. Nothing is real but the maps: time is counted in ticks, and datagrams are handed over, or not.
At the end all must hold the same, and the global map is compared with the map that the optimised poses give in one.
"""
import json
import pathlib
import random
import sys
import tempfile

import numpy as np
from corrected_drive import CELL_M, STEPS, Drive, compared, parser_of

ROBOTS = 3
TICK_US = 50_000
TICKS_OF_A_SCAN = 20
SEED = 21


class Team:
    def __init__(self, tessera, options):
        self.random, self.loss = random.Random(SEED), options.loss
        self.now_us, self.sent, self.lost, self.sent_bytes = 0, 0, 0, 0
        self.maps = [tessera.LocalMap(robot=robot, resolution_m=options.resolution, free_space=False, memory_bytes=2 << 30,
                                      submap_m=options.submap_length) for robot in range(ROBOTS)]
        self.sharers = [tessera.Sharer(one, diffusion="none", fusion_memory_bytes=options.fusion_memory << 20, robot_share=0.5,
                                       bytes_per_s=20_000_000, burst_bytes=4_000_000, label_bytes_per_s=20_000_000,
                                       work_per_tick=3_000_000) for one in self.maps]

    def tick(self):
        self.now_us += TICK_US
        for i, sharer in enumerate(self.sharers):
            for datagram in sharer.tick(self.now_us):
                self.sent += 1
                self.sent_bytes += len(datagram)
                for j, other in enumerate(self.sharers):
                    if j == i:
                        continue
                    if self.random.random() < self.loss:
                        self.lost += 1
                    else:
                        other.receive(datagram, self.now_us)

    def agrees(self):
        return all(s.idle and s.complete for s in self.sharers) and len({s.digest() for s in self.sharers}) == 1


def main():
    parser = parser_of(__doc__)
    parser.add_argument("--loss", type=float, default=0.3, help="share of datagrams that each of the others does not get")
    parser.add_argument("--fusion-memory", type=int, default=3000, help="MiB of each robot")
    options = parser.parse_args()
    sys.path.insert(0, str(options.build / "python"))
    import tessera

    with tempfile.TemporaryDirectory() as name:
        drive = Drive(options, pathlib.Path(name))
        scans = tessera.Clouds(options.drive / "scans", options.drive / "odom_poses.txt")
        optimised = drive.poses("optimized_poses.txt")
        parts = np.array_split(np.arange(len(optimised)), ROBOTS)
        team = Team(tessera, options)
        residuals = [0.0] * ROBOTS
        for step in range(max(map(len, parts))):
            for robot, part in enumerate(parts):
                if step >= len(part):
                    continue
                scan = scans[int(part[step])]
                team.maps[robot].integrate(scan.points, None, scan.T_map_sensor, stamp_us=step + 1)
                done = [round(len(part) * n / STEPS) for n in range(1, STEPS + 1)]
                if step + 1 in done:
                    result = team.sharers[robot].correct(np.arange(1, step + 2), optimised[part[:step + 1]], done.index(step + 1) + 1)
                    residuals[robot] = result["residual_m"]
            for _ in range(TICKS_OF_A_SCAN):
                team.tick()
        ticks = 0
        while not team.agrees() and ticks < 20_000:
            team.tick()
            ticks += 1
        agrees = team.agrees()
        reports = [sharer.report() for sharer in team.sharers]
        team.sharers[0].finish()
        team.sharers[0].global_map.save(drive.folder / "team.tsm")
        drive.map(options.drive / "optimized_poses.txt", "one.tsm")
        figures = compared(drive.cells("team.tsm"), drive.cells("one.tsm"))
        found = {"agrees": agrees, "seconds_after_the_last_scan": ticks * TICK_US * 1e-6, "sent_bytes": team.sent_bytes,
                 "lost": team.lost / max(1, (ROBOTS - 1) * team.sent), "submaps": [r["submap"] + 1 for r in reports],
                 "lost_blocks": [r["lost_blocks"] for r in reports],
                 "refused": [r["global"]["refused_storage"] + r["global"]["refused_quota"] for r in reports],
                 "residual_m": residuals, **figures}
    print(f"three robots, {options.resolution} m, {100 * options.loss:.0f} % loss, seed {SEED}; cells of {CELL_M} m")
    for key, value in found.items():
        print(f"  {key:30} {value}")
    if options.out:
        options.out.write_text(json.dumps(found, indent=1) + "\n")
    return 0 if agrees else 1


if __name__ == "__main__":
    sys.exit(main())

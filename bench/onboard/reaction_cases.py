# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Run by can_reaction.py inside User-Mode Linux: how long a node on a vehicle's bus takes to react, by the times that the
kernel gives to frames. Says them in one line."""
import json
import os
import pathlib
import sys
import time

sys.path.append(str(pathlib.Path(__file__).resolve().parents[2] / "tests" / "can"))
import bus  # noqa: E402  needs the path above
from node_on_bus import NodeOnBus  # noqa: E402

TIMES = int(os.environ["TESSERA_TIMES"])


class Reaction(NodeOnBus):
    def first(self, name, **values):
        return bus.until(lambda: self.bus.first(name, **values), f"{name} with {values}, but {self.bus.state()}")

    def commands(self):
        """From the first frame of a command until a heartbeat says that it is followed. The vehicle's cycle and the node's drift
        against each other by the pauses between."""
        times_ms = []
        for number in range(1, TIMES + 1):
            name, state, reason = (("Start", "Mapping", "None"), ("Pause", "Paused", "Command"))[number % 2]
            self.bus.keep("COMMAND", "HEARTBEAT")
            self.command(name, number % 250 + 1)
            sent_s = self.first("COMMAND", Command=name)
            times_ms.append(1e3 * (self.first("HEARTBEAT", MappingState=state, PauseReason=reason) - sent_s))
            time.sleep(0.013 * (number % 7))
        return times_ms

    def lost_poses(self):
        """From the last frame of the last pose until a heartbeat says StalePose; 200 ms of patience are in it."""
        times_ms = []
        for number in range(TIMES):
            self.vehicle.with_pose = False
            self.bus.keep("HEARTBEAT")
            said_s = self.first("HEARTBEAT", MappingState="Paused", PauseReason="StalePose")
            with self.bus.lock:
                last_s = self.bus.times[bus.FILE.named("POSE_RP").id][-1]
            times_ms.append(1e3 * (said_s - last_s))
            self.vehicle.with_pose = True
            self.comes_to("Mapping", "None")
            time.sleep(0.013 * (number % 7))
        return times_ms

    def test_reaction(self):
        node = self.start()
        found = {"command": self.commands(), "lost pose": self.lost_poses()}
        node.end()
        print("measured " + json.dumps(found), file=sys.stderr)

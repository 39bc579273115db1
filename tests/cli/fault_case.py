# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""What tests of a node's faults share: a node with sensors before a wall, and what it says of them."""
import contextlib
import pathlib
import sys

import command_case

sys.path.append(str(pathlib.Path(__file__).resolve().parent.parent / "support"))
from running_node import RunningNode, sensing, until, write_config
from sensor_sender import Sensors


class Faults(command_case.CommandCase):
    def setUp(self):
        super().setUp()
        self.closing = contextlib.ExitStack()
        self.addCleanup(self.closing.close)

    def sensors(self, **options):
        sensors = Sensors(**options)
        self.closing.callback(sensors.close)
        return sensors

    def node(self, name="node", number=0, environment=None, **changes):
        config = write_config(self.folder, name, sensing(name, number), **changes)
        node = RunningNode(self.folder, config, environment=environment)
        self.closing.callback(node.close)
        return node

    def mapping(self, before=lambda: None, **changes):
        """A node that maps already, and its sensors."""
        before()
        sensors = self.sensors(with_poses=False)
        return self.node_that_maps(sensors, **changes), sensors

    def node_that_maps(self, sensors, /, **changes):
        """The next one of these sensors. They give no pose before it pauses, as its going on is what it says."""
        sensors.with_poses = False
        node = self.node(**changes)
        node.says("mapping: paused")
        sensors.with_poses = True
        node.says("mapping: resumes")
        clouds = sensors.clouds
        until(lambda: sensors.clouds > clouds + 3, "scans")
        return node

    def states_at(self, *points, file="node.tsm"):
        rows = self.query_rows(file, "x,y,z\n" + "".join(f"{x},{y},{z}\n" for x, y, z in points))[1]
        return [(row["state"], int(row["label"])) for row in rows]

    def check_scans(self, report, sensors):
        """No cloud is in two counters, and those that were given are mapped or left out while mapping paused. Clouds from before
        the node heard are in none."""
        match = report["sensors"]["match"]
        ends = ("given", "future", "ancient", "duplicates", "out_of_order", "without_pose", "without_images", "superseded", "unknown_sensor")
        self.assertLessEqual(sum(match[end] for end in ends), sensors.clouds)
        mapping = report["mapping"]
        done = mapping["cycles"] + mapping["paused"]
        self.assertLessEqual(done, match["given"])
        # What waits when the node ends.
        self.assertGreaterEqual(done, match["given"] - 2)

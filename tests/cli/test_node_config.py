# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""tessera node: what is wrong with a configuration is said before anything starts."""
import unittest

from command_case import USAGE
from node_case import NodeCase


class BadConfiguration(NodeCase):
    """Refused in one line, before anything is begun."""

    def bad(self, *saying, **changes):
        path = self.config(0, "bad", **changes)
        before = sorted(self.folder.rglob("*"))
        self.refused("node", "--config", path, saying=saying, exit_status=USAGE)
        self.assertEqual(before, sorted(self.folder.rglob("*")))

    def test_words(self):
        self.bad("line 3", "unknown key stat in [robot]; did you mean state?", robot={"state": None, "stat": "s"})
        self.bad("unknown key max_range in [map]", "max_range_m", map={"max_range": 20})
        self.bad("unknown table [netwrok]; did you mean [network]?", netwrok={"url": "x"})
        self.bad("unknown key rate_hz in [run]; it is in [replay]", run={"rate_hz": 1})
        self.bad("[robot] id: is missing", robot={"id": None})
        self.bad("[replay] dataset: is missing", replay={"dataset": None})

    def test_values(self):
        self.bad("[robot] id: is not a whole number", robot={"id": "zero"})
        self.bad("[robot] id: -1 is not allowed", "line 2", robot={"id": -1})
        self.bad("[replay] rate_hz: -1 is not allowed", replay={"rate_hz": -1})
        self.bad("[replay] loop: is not true or false", replay={"loop": 1})
        self.bad("[map] memory: is not a number of bytes", map={"memory": "much"})
        self.bad("[map] memory", "give at least", map={"memory": "1K"})
        self.bad("line 8: [map] resolution_m: 0 is not allowed", map={"resolution_m": 0})
        self.bad("[map] kernel_length_m", map={"inference": "counting", "kernel_length_m": 0.5})
        self.bad("[map] downsample_m", map={"downsample_m": "of"})
        self.bad("[fusion] diffusion: strong is not allowed; give contractive, paper or none",
                 fusion={"diffusion": "strong"})
        self.bad("[fusion] alpha", fusion={"alpha": 1})
        self.bad("[fusion] memory", "give at least", fusion={"memory": "1M"})
        self.bad("[security] exclude", "list of numbers", security={"exclude": ["x"]})
        self.bad("[security] exclude: is not a list of whole numbers", security={"exclude": [-1]})
        self.bad("[security] exclude: names this robot itself", security={"exclude": [3, 0]})
        self.bad("[security] exclude: takes at most 16 robots", security={"exclude": list(range(1, 18))})
        for key in ("fleet_key", "robot_secret", "robot_public_keys"):
            self.bad(f"[security] {key}: is empty", security={key: ""})
        self.bad("name robot_public_keys too", security={"robot_secret": "keys/robot_0.key"})
        self.bad("name robot_secret too", security={"robot_public_keys": "fleet.pub"})
        self.fleet_keys(2)
        self.bad("robot_1.key is of robot 1, and this is robot 0", security={"robot_secret": "keys/robot_1.key", "robot_public_keys": "all.pub"})
        self.bad("robot 1 is not among the public keys", "fleet.pub",
                 security={"robot_secret": "keys/robot_1.key", "robot_public_keys": "fleet.pub"})
        self.bad("[replay] first", replay={"first": 9, "last": 1})
        self.bad("[replay] labels", replay={"labels": "nothing"})

    def test_what_is_named_is_not_there(self):
        self.bad("nowhere", replay={"dataset": "nowhere"})
        self.bad("fleet.key", security={"fleet_key": "fleet.key"})
        self.bad("kernels.toml", map={"resolution_m": 0.2, "kernels": "kernels.toml"})
        self.bad("nowhere", output={"report": "nowhere/report.json"})
        self.bad("the same file", output={"report": "one", "global_map": "one"})
        self.bad("eth99", network={"interface": "eth99"})
        self.bad("ttl", network={"url": "udpm://239.255.76.67:7667"})
        self.refused("node", "--config", "no.toml", saying=("no.toml",))
        self.refused("node", saying=("--config",))
        (self.folder / "bad.toml").write_text("[robot\n")
        self.refused("node", "--config", "bad.toml", saying=("line 1", "not valid TOML"))

    def test_queries_stay_on_the_machine(self):
        url = "udpm://239.255.76.69:7669?ttl={}"
        self.bad("[service] url", "ttl=0", service={"queries": True, "url": url.format(1)})
        self.done("node", "--check", "--config", self.config(0, service={"queries": True, "url": url.format(0)}))

    def test_what_sensors_and_vehicle_cannot_be_set_up_with(self):
        """Also by --check: it passes nothing that the start refuses."""
        (self.folder / "cameras.toml").write_text('[[camera]]\nname = "front"\nmodel = "pinhole"\nwidth = 64\nheight = 48\n'
                                                  'focal = [32, 32]\ncentre = [32, 24]\nmask = "nowhere.png"\n'
                                                  'T_camera_lidar = [0, -1, 0, 0, 0, 0, -1, 0, 1, 0, 0, 0]\n')
        for changes, words in (({"replay": {"dataset": None, "rate_hz": None}, "sensors": {"clouds": "raw", "cameras": "cameras.toml"}},
                                "nowhere.png"),
                               ({"map": {"resolution_m": 0.01, "max_range_m": 20.0}, "vehicle": {"can": "can7", "sector_range_m": 60}},
                                "sector_range_m")):
            with self.subTest(words):
                self.bad(words, **changes)
                self.refused("node", "--check", "--config", self.config(0, "bad", **changes), saying=(words,))

    def test_a_count_of_starts_that_is_none(self):
        (self.folder / "state").mkdir()
        (self.folder / "state/robot_0.starts").write_text("many\n")
        self.refused("node", "--config", self.config(0, "bad"), saying=("is not a count of starts",))

    def test_a_state_that_is_damaged(self):
        (self.folder / "state").mkdir()
        (self.folder / "state/robot_0.state").write_text("tessera-robot-state 1\n")
        self.refused("node", "--config", self.config(0, "bad"), saying=("robot_0.state is damaged",))


if __name__ == "__main__":
    unittest.main()

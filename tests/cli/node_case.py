# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""What tests of tessera node share: a street for two robots, configurations, keys."""
import json
import subprocess
import time

from command_case import DONE, TIME_LIMIT_S, CommandCase, command_path

SCANS = 4


class NodeCase(CommandCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.street = cls.class_folder() + "/street"
        cls.simulate(cls.street, "--scans", SCANS, "--seed", 5)

    def config(self, number, name=None, /, **changes):
        """Writes a configuration; changes: by table, a dictionary of keys, None to leave one out."""
        name = name or f"robot_{number}"
        tables = {
            "robot": {"id": number, "state": "state"},
            "replay": {"dataset": f"{self.street}/robot_{number}", "rate_hz": 0},
            "map": {"resolution_m": 0.4, "max_range_m": 60.0, "memory": "40M"},
            "publish": {"staleness_s": 0.2, "free_staleness_s": 0.4},
            "network": {"url": f"udpm://239.255.76.67:7667?ttl=0&recv_buf_size=400000", "interface": "lo"},
            "fusion": {"memory": "32M"},
            "output": {"global_map": f"{name}.global.tsm", "contribution": f"{name}.contribution.tsm", "report": f"{name}.json"},
            "run": {"wait_for_peers": 1, "quiet_s": 2, "linger_s": 60},
        }
        for table, keys in changes.items():
            tables.setdefault(table, {}).update(keys)
        lines = []
        for table, keys in tables.items():
            lines.append(f"[{table}]")
            lines += [f"{key} = {json.dumps(value)}" for key, value in keys.items() if value is not None]
        path = self.folder / f"{name}.toml"
        path.write_text("\n".join(lines) + "\n")
        return path

    def begin_node(self, config):
        return subprocess.Popen([command_path(), "node", "--config", str(config)], cwd=self.folder, text=True, stdin=subprocess.DEVNULL,
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE)

    def end_of_node(self, config, node, meanwhile=lambda: None):
        """Its report, and what it said; it ends by itself, and well."""
        try:
            meanwhile()
            _, error = node.communicate(timeout=TIME_LIMIT_S)
        finally:
            if node.poll() is None:
                node.kill()
                node.communicate()
        self.assertEqual(DONE, node.returncode, error)
        return json.loads(config.with_suffix(".json").read_text()), error

    def fleet_keys(self, robots):
        """Secrets in keys/, all public keys in all.pub, and all but the last robot's in fleet.pub."""
        self.done("key", "new", "--robots", robots, "--dir", "keys")
        public = [(self.folder / f"keys/robot_{robot}.pub").read_text() for robot in range(robots)]
        (self.folder / "all.pub").write_text("".join(public))
        (self.folder / "fleet.pub").write_text("".join(public[:-1]))


class PlayedCase(NodeCase):
    """A node whose sensors are played: one robot in a street. In a network of the test's own."""
    SCANS = 12

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.street = f"{cls.street}_{cls.SCANS}"
        cls.simulate(cls.street, "--robots", 1, "--scans", cls.SCANS, "--seed", 5)
        # liblcm asks the routes where to send.
        subprocess.run(["ip", "route", "replace", "224.0.0.0/4", "dev", "lo"], check=True, timeout=TIME_LIMIT_S)

    def sensing(self, **changes):
        """As config(), of a node with sensors."""
        tables = {"replay": {"dataset": None, "rate_hz": None}, "sensors": {"points": 150000}, "run": {"wait_for_peers": 0, "duration_s": 6},
                  "map": {"deadline_ms": 1000}, "realtime": {"priority": 0}}
        for table, keys in changes.items():
            tables[table] = {**tables.get(table, {}), **keys}
        return self.config(0, **tables)

    def run_with_player(self, config, *options, source=None, meanwhile=lambda: None):
        """The node's report, and what it said. source: options that name what is played; the street if None."""
        def play():
            time.sleep(1)
            self.done("play", *(source or ("--dataset", f"{self.street}/robot_0")), "--interface", "lo", "--rate", 10, *options)
            meanwhile()

        return self.end_of_node(config, self.begin_node(config), play)

# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""What tests of tessera node share: a street for two robots, configurations, keys."""
import json

from command_case import CommandCase

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
            "map": {"resolution_m": 0.4, "max_range_m": 60.0, "memory": "24M"},
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

    def fleet_keys(self, robots):
        """Secrets in keys/, all public keys in all.pub, and all but the last robot's in fleet.pub."""
        self.done("key", "new", "--robots", robots, "--dir", "keys")
        public = [(self.folder / f"keys/robot_{robot}.pub").read_text() for robot in range(robots)]
        (self.folder / "all.pub").write_text("".join(public))
        (self.folder / "fleet.pub").write_text("".join(public[:-1]))

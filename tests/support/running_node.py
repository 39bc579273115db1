# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""A node in a process of its own, what it says while it runs, and its report when it has ended."""
import json
import os
import signal
import subprocess
import threading
import time

LIMIT_S = 30


def until(holds, what, limit_s=LIMIT_S):
    """Waits for it, however long the machine takes within the limit; gives what it was."""
    end = time.monotonic() + limit_s
    while time.monotonic() < end:
        found = holds()
        if found:
            return found
        time.sleep(0.02)
    raise AssertionError(f"this did not come: {what}")


def write_config(folder, name, tables, /, **changes):
    """changes: by table, a dictionary of keys, None to leave one out."""
    tables = {table: dict(keys) for table, keys in tables.items()}
    for table, keys in changes.items():
        tables.setdefault(table, {}).update(keys)
    lines = []
    for table, keys in tables.items():
        lines.append(f"[{table}]")
        lines += [f"{key} = {json.dumps(value)}" for key, value in keys.items() if value is not None]
    path = folder / f"{name}.toml"
    path.write_text("\n".join(lines) + "\n")
    return path


def sensing(name="node", robot=0):
    """Tables of a node with sensors and one map, small enough for any machine."""
    return {"robot": {"id": robot, "state": "state"}, "sensors": {"points": 4000},
            "map": {"resolution_m": 0.2, "max_range_m": 20.0, "memory": "32M", "submap_m": 0},
            "network": {"url": "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=400000", "interface": "lo"},
            "publish": {"staleness_s": 0.2, "free_staleness_s": 0.4, "blocks": 4096}, "fusion": {"memory": "32M"},
            "realtime": {"priority": 0, "lock_memory": False}, "service": {"queries": False},
            "output": {"local_map": f"{name}.tsm", "report": f"{name}.json"}}


class RunningNode:
    def __init__(self, folder, config, *before, environment=None):
        self.folder, self.report_path = folder, config.with_suffix(".json")
        self.said, self.lines = "", threading.Condition()
        self.process = subprocess.Popen([*before, os.environ["TESSERA_COMMAND"], "node", "--config", str(config)], cwd=folder, text=True,
                                        env={**os.environ, **(environment or {})}, stdin=subprocess.DEVNULL,
                                        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        self.reader = threading.Thread(target=self.read, daemon=True)
        self.reader.start()

    def read(self):
        for line in self.process.stderr:
            with self.lines:
                self.said += line
                self.lines.notify_all()

    def says(self, words, since=0, limit_s=LIMIT_S):
        """Waits until it has said so behind that place of all that it said; gives the place behind it."""
        with self.lines:
            if not self.lines.wait_for(lambda: words in self.said[since:], limit_s):
                raise AssertionError(f"it does not say {words!r}: {self.said}")
            return self.said.index(words, since) + len(words)

    def here(self):
        with self.lines:
            return len(self.said)

    def end(self, by=signal.SIGTERM):
        """Its report, and what it said."""
        self.process.send_signal(by)
        self.process.wait(timeout=LIMIT_S)
        self.reader.join(LIMIT_S)
        if self.process.returncode != 0:
            raise AssertionError(f"it ended with {self.process.returncode}: {self.said}")
        return json.loads(self.report_path.read_text())

    def kill(self):
        self.process.kill()
        self.process.wait(timeout=LIMIT_S)

    def close(self):
        if self.process.poll() is None:
            self.kill()
        self.reader.join(LIMIT_S)
        self.process.stderr.close()

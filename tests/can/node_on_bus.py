# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""A whole node on a vehicle's bus, in a kernel that has vcan: the vehicle before a wall, its sensors, and what candump hears."""
import collections
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import threading
import time
import unittest

sys.path.append(str(pathlib.Path(__file__).resolve().parent.parent / "support"))
import bus
import running_node
import sensor_sender

LINE = re.compile(r"\((\d+\.\d+)\) \S+ ([0-9A-F]+)(##[0-9A-F]|#)([0-9A-F]*)")
COMMAND_EACH = 5


class Vehicle(bus.Vehicle):
    """Stands at the origin unless told otherwise; a command is said in each fifth cycle."""

    def __init__(self, interface):
        self.x, self.deviation, self.wheel_speed, self.damaged = 0.0, 0.02, 0.0, False
        self.alternating, self.far, self.silent = False, False, False
        self.command, self.cycles = ("None", 0), 0
        super().__init__(interface)

    def send(self, number, data):
        super().send(number, bytes([data[0] ^ 0x5A]) + data[1:] if self.damaged else data)

    def cycle(self, begin):
        self.cycles += 1
        if self.silent:
            return
        self.send(*self.frame("ODOMETRY", OdometryValid="Valid", WheelSpeed=self.wheel_speed, YawRate=0.0, StdWheelSpeed=0.02))
        if self.cycles % COMMAND_EACH == 0:
            self.send(*self.frame("COMMAND", Command=self.command[0], CommandNumber=self.command[1]))
        counter = self.pose = (self.pose + 1) % 16
        if not self.with_pose:
            return
        if self.far:  # Beyond all that is sensible, which only the frame of CAN FD can say.
            self.send(*self.frame("POSE_FD", PoseValid="Valid", X=150_000.0, Age=5.0, StdX=0.02, StdHeading=0.003, Roll=0.0, Pitch=0.0))
            return
        x = self.x if not self.alternating else self.x + 40.0 * (-1) ** self.cycles
        self.send(*self.frame("POSE_XY", PoseCounter=counter, X=x, Y=0.0))
        self.send(*self.frame("POSE_ZH", PoseCounter=counter, Z=0.0, Heading=0.0, Age=5))
        self.send(*self.frame("POSE_RP", PoseCounter=counter, StdPosition=self.deviation, StdHeading=0.003, Roll=0.0, Pitch=0.0))


class Candump:
    """What is on the bus from now on: the last frame of each message, how many there were, and when; and all of those to keep."""

    def __init__(self, interface):
        self.last, self.times, self.lock = {}, collections.defaultdict(list), threading.Lock()
        self.kept = {}
        self.process = subprocess.Popen(["candump", "-L", interface], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        self.reader = threading.Thread(target=self.read, daemon=True)
        self.reader.start()

    def read(self):
        for line in self.process.stdout:
            found = LINE.match(line)
            if found is None:
                continue
            with self.lock:
                number = int(found[2], 16)
                self.last[number] = bytes.fromhex(found[4])
                self.times[number].append(float(found[1]))
                if number in self.kept:
                    self.kept[number].append((float(found[1]), self.last[number]))

    def keep(self, *names):
        """Keeps the frames of these messages from now on, and none of before."""
        with self.lock:
            self.kept = {bus.FILE.named(name).id: [] for name in names}

    def first(self, name, **values):
        """When the first of the kept frames with these values came, or None."""
        signals = bus.FILE.named(name).signals
        with self.lock:
            kept = list(self.kept[bus.FILE.named(name).id])
        for at_s, data in kept:
            if all((signals[key].named(data) or signals[key].value(data)) == value for key, value in values.items()):
                return at_s
        return None

    def count(self, name):
        with self.lock:
            return len(self.times[bus.FILE.named(name).id])

    def value(self, name, signal):
        message = bus.FILE.named(name)
        with self.lock:
            data = self.last.get(message.id)
        return None if data is None else message.signals[signal].named(data) or message.signals[signal].value(data)

    def state(self):
        return self.value("HEARTBEAT", "MappingState"), self.value("HEARTBEAT", "PauseReason")

    def close(self):
        self.process.terminate()
        self.process.wait(timeout=bus.LIMIT_S)
        self.reader.join(bus.LIMIT_S)
        self.process.stdout.close()


class NodeOnBus(unittest.TestCase):
    number = 0

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="tessera-bus-")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        NodeOnBus.number += 1
        self.interface = bus.Interface(f"n{NodeOnBus.number}")
        self.vehicle = Vehicle(self.interface.name)
        self.addCleanup(self.vehicle.close)
        self.bus = self.dump()

    def dump(self):
        opened = Candump(self.interface.name)
        self.addCleanup(opened.close)
        return opened

    def start(self, mode="pose", clock=time.monotonic, **changes):
        """A node that maps already."""
        tables = running_node.sensing()
        tables["sensors"].update({"poses": "can", "clock": "wall" if clock is time.time else "monotonic"})
        # As on a robot, but for its memory, which takes a kernel of this kind seconds to lock.
        tables["realtime"] = {"priority": 40, "lock_memory": False}
        tables["vehicle"] = {"can": self.interface.name, "mode": mode}
        config = running_node.write_config(self.folder, "node", tables, **changes)
        self.node = running_node.RunningNode(self.folder, config)
        self.addCleanup(self.node.close)
        self.sensors = sensor_sender.Sensors(clock=clock, with_poses=False)
        self.sensors.x_m = lambda: self.vehicle.x
        self.addCleanup(self.sensors.close)
        self.comes_to("Mapping", "None")
        bus.until(lambda: self.bus.value("MAP_FILL", "Blocks"), "a map")
        return self.node

    def comes_to(self, state, reason, what=""):
        """Waits until the heartbeat says so; prints how long that took, as a figure, not a promise."""
        begin = time.monotonic()
        bus.until(lambda: self.bus.state() == (state, reason), f"{what} {state} {reason}, but {self.bus.state()}: {self.node.said}")
        if what:
            print(f"noticed on the bus: {what}: {state} {reason} after {1e3 * (time.monotonic() - begin):.0f} ms", file=sys.stderr)

    def command(self, name, number):
        """By cansend, twice, as docs/reference/can.md asks for."""
        for _ in range(2):
            identifier, data = self.vehicle.frame("COMMAND", Command=name, CommandNumber=number)
            bus.cansend(self.interface.name, f"{identifier:03X}#{data.hex()}")
        self.vehicle.command = (name, number)
        bus.until(lambda: self.bus.value("HEARTBEAT", "LastCommandNumber") == number, f"command {name}")

    def wall_is_where_it_is(self):
        """By the map file, which was saved: all that has a label is the wall."""
        said = subprocess.run([os.environ["TESSERA_COMMAND"], "info", "node.tsm", "--report", "info.json"], cwd=self.folder, text=True,
                              capture_output=True, timeout=bus.LIMIT_S, check=False)
        self.assertEqual(0, said.returncode, said.stderr)
        voxels = int(re.search(r"(\d+) labelled or occupied", said.stdout)[1])
        # 6.1 m by 2 m of voxels of 0.2 m, one or two deep; the rays to it; and nothing mapped from anywhere else.
        self.assertIn(voxels, range(300, 800), said.stdout)
        self.assertRegex(said.stdout, rf"{voxels} +building")
        extent = [float(m) for m in re.search(r"extent +([\d.]+) x ([\d.]+) x ([\d.]+) m", said.stdout).groups()]
        for found, most in zip(extent, (5.6, 6.4, 2.4), strict=True):
            self.assertLessEqual(found, most, said.stdout)

    def check_counters(self, report):
        vehicle = report["vehicle"]
        self.assertEqual(vehicle["frames"], vehicle["foreign"] + vehicle["misshapen"] + vehicle["refused"] + vehicle["accepted"])
        self.assertEqual(0, vehicle["foreign"], "the filter lets through what is not for us")
        return vehicle

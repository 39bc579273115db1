# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""What tests on a real SocketCAN bus share: a virtual interface, the program under test, a vehicle that speaks by the DBC
file, and what candump heard."""
import json
import os
import pathlib
import re
import select
import socket
import struct
import subprocess
import threading
import time

import dbc
import e2e

FILE = dbc.read(pathlib.Path(os.environ["TESSERA_SOURCE"]) / "docs/reference/can/tessera.dbc")
LIMIT_S = 20
CYCLE_S = 0.02


def ip(*words):
    subprocess.run(["ip", *words], check=True, capture_output=True, timeout=LIMIT_S)


def cansend(interface, frame):
    subprocess.run(["cansend", interface, frame], check=True, capture_output=True, timeout=LIMIT_S)


def until(holds, what):
    """Waits for it, however long the machine takes within LIMIT_S."""
    end = time.monotonic() + LIMIT_S
    while time.monotonic() < end:
        found = holds()
        if found:
            return found
        time.sleep(0.02)
    raise AssertionError(f"this did not come: {what}")


class Interface:
    def __init__(self, name, fd=True):
        self.name, self.fd = name, fd
        self.add()

    def add(self):
        ip("link", "add", self.name, "type", "vcan")
        ip("link", "set", self.name, "mtu", "72" if self.fd else "16", "up")

    def up(self):
        ip("link", "set", self.name, "up")

    def down(self):
        ip("link", "set", self.name, "down")

    def remove(self):
        ip("link", "del", self.name)


class Member:
    def __init__(self, interface, *words):
        self.process = subprocess.Popen([os.environ["TESSERA_CAN_MEMBER"], interface, *map(str, words)], stdin=subprocess.PIPE,
                                        stdout=subprocess.PIPE, text=True, bufsize=1)
        self.begins_with = self.line()

    def line(self):
        if not select.select([self.process.stdout], [], [], LIMIT_S)[0]:
            raise AssertionError("the member does not answer")
        return self.process.stdout.readline().strip()

    def status(self, word=""):
        self.process.stdin.write(word + "\n")
        return json.loads(self.line())

    def close(self):
        self.process.stdin.close()
        self.process.wait(timeout=LIMIT_S)
        self.process.stdout.close()
        return self.process.returncode


class Vehicle(threading.Thread):
    """Drives along x at 1 m/s and says so every 20 ms."""

    def __init__(self, interface, fd=False):
        super().__init__(daemon=True)
        self.fd, self.interface = fd, interface
        self.counters, self.pose = {}, 0
        self.with_pose, self.stopping = True, False
        self.socket = self.open()
        self.start()

    def open(self):
        opened = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        try:
            opened.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FD_FRAMES, 1)
            opened.bind((self.interface,))
        except OSError:
            opened.close()
            raise
        return opened

    def frame(self, name, **values):
        message = FILE.named(name)
        data = bytes(message.size)
        for signal, value in values.items():
            data = message.signals[signal].put(data, value)
        counter = self.counters[name] = self.counters.get(name, -1) + 1
        return message.id, e2e.sealed(FILE.attribute(message, "E2EProfile"), FILE.attribute(message, "E2EDataID"), counter, data)

    def send(self, number, data):
        kind = "=IBBBB64s" if len(data) > 8 else "=IBBBB8s"
        try:
            self.socket.send(struct.pack(kind, number, len(data), 1 if len(data) > 8 else 0, 0, 0, data))
        except OSError:  # Interface down, or gone and come again.
            try:
                self.socket.close()
                self.socket = self.open()
            except OSError:
                pass

    def cycle(self, begin):
        x = time.monotonic() - begin
        self.send(*self.frame("ODOMETRY", OdometryValid="Valid", WheelSpeed=1.0, YawRate=0.0, StdWheelSpeed=0.02))
        common = {"StdHeading": 0.003, "Roll": 0.0, "Pitch": 0.0}
        counter = self.pose = (self.pose + 1) % 16
        if not self.with_pose:
            return
        if self.fd:
            self.send(*self.frame("POSE_FD", PoseValid="Valid", X=x, Age=5.0, StdX=0.02, **common))
            return
        self.send(*self.frame("POSE_XY", PoseCounter=counter, X=x, Y=2.0))
        self.send(*self.frame("POSE_ZH", PoseCounter=counter, Z=0.0, Heading=0.0, Age=5))
        self.send(*self.frame("POSE_RP", PoseCounter=counter, StdPosition=0.02, **common))

    def run(self):
        begin = time.monotonic()
        while not self.stopping:
            self.cycle(begin)
            time.sleep(CYCLE_S)

    def close(self):
        self.stopping = True
        self.join(LIMIT_S)
        self.socket.close()


class Heard:
    """Frames of one message as candump saw them, in order."""

    def __init__(self, text):
        self.frames = {}
        for number, kind, data in re.findall(r"\(\d+\.\d+\) \S+ ([0-9A-F]+)(##[0-9A-F]|#)([0-9A-F]*)", text):
            self.frames.setdefault(int(number, 16), []).append((kind != "#", bytes.fromhex(data)))

    def of(self, name):
        return [data for _, data in self.frames.get(FILE.named(name).id, [])]


def listen(interface, enough):
    """What is on the bus, until enough(Heard) holds."""
    process = subprocess.Popen(["candump", "-L", interface], stdout=subprocess.PIPE)
    text = b""
    try:
        end = time.monotonic() + LIMIT_S
        while time.monotonic() < end:
            if select.select([process.stdout], [], [], 0.1)[0]:
                text += os.read(process.stdout.fileno(), 1 << 16)
            heard = Heard(text.decode())
            if enough(heard):
                return heard
            time.sleep(0.05)
        raise AssertionError(f"not enough was heard: { {hex(k): len(v) for k, v in heard.frames.items()} }")
    finally:
        process.terminate()
        process.wait(timeout=LIMIT_S)
        process.stdout.close()

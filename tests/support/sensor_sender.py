# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""The sensors of a robot before a wall, over LCM: labelled clouds, and poses at its origin unless told otherwise. x_m says
where the robot really is, which clouds are seen from."""
import socket
import struct
import threading
import time

GROUP = ("239.255.76.68", 7668)
# As lcm-gen makes them of lcmtypes/: the hash of a type without other types in it, turned left by one bit.
FINGERPRINTS = {name: (base << 1 | base >> 63) & (1 << 64) - 1
                for name, base in (("TESSERA_SEMANTIC_CLOUD", 0x25BAE4C85472FFC2), ("TESSERA_POSE", 0x97DC84AD85C7227D),
                                   ("TESSERA_CLOUD", 0xB94E99DCCF6D86E6), ("TESSERA_LABEL_IMAGE", 0x7F5B86036D7B100D))}
WALL_AT_M, WALL_CLASS = 5.1, 13
IDENTITY = (1.0, 0.0, 0.0, 0.0)


def wall():
    """x y z of its points: 6 m wide, 2 m high, straight ahead."""
    return [(WALL_AT_M, -3.0 + 0.1 * i, -0.95 + 0.1 * k) for i in range(61) for k in range(20)]


class Sensors(threading.Thread):
    """Sends until close(); what it sends can be changed at any time. A pose each pose_every * 20 ms; moves: they go along x_m."""

    def __init__(self, clock=time.monotonic, with_poses=True, period_s=0.1, pose_every=1):
        super().__init__(daemon=True)
        self.clock, self.period_s, self.pose_every, self.moves = clock, period_s, pose_every, False
        self.with_poses, self.with_clouds, self.stopping = with_poses, True, False
        self.offset_s, self.position, self.rotation, self.sigma_m = 0.0, [0.0, 0.0, 0.0], IDENTITY, 0.02
        self.numbers, self.sequence, self.clouds = 0, 0, 0
        self.component, self.image = WALL_CLASS, None
        self.points, self.x_m = wall(), lambda: 0.0
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("127.0.0.1"))
        self.socket.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        self.start()

    def send(self, channel, payload):
        head = struct.pack(">II", 0x4C433032, self.numbers)
        self.numbers += 1
        self.socket.sendto(head + channel.encode() + b"\0" + struct.pack(">Q", FINGERPRINTS[channel]) + payload, GROUP)

    def stamp_us(self):
        return round(1e6 * (self.clock() + self.offset_s))

    def send_pose(self):
        self.sequence += 1
        x, y, z = self.position
        if self.moves:
            x += self.x_m()
        self.send("TESSERA_POSE", struct.pack(">qii11d", self.stamp_us(), self.sequence, 2, x, y, z, *self.rotation,
                                              *[self.sigma_m] * 3, 0.002))

    def send_cloud(self, stamp_us=None, points=None, component=WALL_CLASS):
        """component: None for a cloud without labels."""
        points = self.points if points is None else points
        count, x_m = len(points), self.x_m()
        flat = [axis for x, y, z in points for axis in (x - x_m, y, z)]
        stamp_us = self.stamp_us() if stamp_us is None else stamp_us
        self.clouds += 1
        if component is None:
            self.send("TESSERA_CLOUD", struct.pack(f">qiiiii{3 * count}f", stamp_us, 0, count, 3 * count, 0, 0, *flat))
        else:
            self.send("TESSERA_SEMANTIC_CLOUD", struct.pack(f">qiiiiiiii{3 * count}f", stamp_us, 0, count, 3 * count, count, 0, 0, 0, 0, *flat) +
                      bytes([component]) * count)
        return stamp_us

    def send_image(self, stamp_us, width, height, component=WALL_CLASS):
        self.send("TESSERA_LABEL_IMAGE", struct.pack(">qiiii", stamp_us, 0, width, height, width * height) +
                  bytes([component]) * (width * height))

    def run(self):
        cycle = 0
        while not self.stopping:
            if self.with_poses and cycle % self.pose_every == 0:
                self.send_pose()
            if self.with_clouds and cycle % max(1, round(self.period_s / 0.02)) == 0:
                stamp_us = self.send_cloud(component=self.component)
                if self.image is not None:
                    self.send_image(stamp_us, *self.image)
            cycle += 1
            time.sleep(0.02)

    def close(self):
        self.stopping = True
        self.join(20)
        self.socket.close()

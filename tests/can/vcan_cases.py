# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Run by test_vcan.py inside User-Mode Linux: the port on virtual CAN interfaces, with can-utils as its opposite."""
import contextlib
import itertools
import subprocess
import time
import unittest

import bus
import e2e

NAMES = ("v%d" % i for i in itertools.count())
STATES = ("Active", "Passive", "Off", "Down")


class Vcan(unittest.TestCase):
    def setUp(self):
        self.closing = contextlib.ExitStack()
        self.addCleanup(self.closing.close)

    def interface(self, **options):
        return bus.Interface(next(NAMES), **options)

    def member(self, interface, *words):
        member = bus.Member(interface.name, *words)
        self.closing.callback(lambda: self.assertEqual(0, member.close()))
        self.assertEqual("ready", member.begins_with)
        return member

    def vehicle(self, interface, **options):
        vehicle = bus.Vehicle(interface.name, **options)
        self.closing.callback(vehicle.close)
        return vehicle

    def check_counters(self, status):
        inputs, socket = status["inputs"], status["socket"]
        self.assertTrue(status["got"])
        self.assertEqual(inputs["frames"], inputs["foreign"] + inputs["misshapen"] + inputs["refused"] + inputs["accepted"])
        self.assertEqual(sum(inputs["by_status"]), inputs["refused"] + inputs["accepted"])
        self.assertEqual(inputs["frames"], socket["received"])
        self.assertEqual(0, inputs["foreign"], "the filter lets through what is not for us")
        self.assertEqual(0, status["seen"]["backwards"])

    def check_sequence(self, heard, name):
        """Checksums are right and counters have no hole."""
        message = bus.FILE.named(name)
        profile = bus.FILE.attribute(message, "E2EProfile")
        modulus = 15 if profile == "Profile1A" else 256
        frames = heard.of(name)
        for data in frames:
            self.assertEqual(message.size, len(data), name)
            if profile != "None":
                self.assertTrue(e2e.is_right(profile, bus.FILE.attribute(message, "E2EDataID"), data), name)
        if profile == "None":
            return
        counters = [message.signals["Counter"].raw(data) for data in frames]
        for before, after in zip(counters, counters[1:]):
            self.assertEqual((before + 1) % modulus, after, name)

    def check_sectors(self, heard, name, count):
        message = bus.FILE.named(name)
        for data in heard.of(name):
            for signal in message.signals.values():
                if not signal.name.startswith("Sector"):
                    continue
                number, part = int(signal.name[6:8]), signal.name[8:]
                value = signal.value(data)
                if part == "Distance" and number % 3 == 0:
                    self.assertEqual("NothingFound", signal.named(data))
                elif part == "Distance":
                    self.assertAlmostEqual(2.0 + 0.5 * number, value, delta=0.051)
                elif part == "FreeUpTo":
                    self.assertEqual(min(1 + number, 31), value)
                elif part == "Class" and number % 3 != 0:
                    self.assertEqual(number + 1, value)
                elif part == "Confidence" and number % 3 != 0:
                    self.assertAlmostEqual(0.85, value)
                self.assertLess(number, count)

    def check_report(self, heard, sectors, fd):
        sent = [m.name for m in bus.FILE.messages.values() if m.sender == "TESSERA"]
        for name in sent:
            self.check_sequence(heard, name)
            if name.startswith("SECTORS"):
                used = name.startswith("SECTORS_FD") == fd and int(name[-2:]) < sectors
                self.assertEqual(used, bool(heard.of(name)), name)
                self.check_sectors(heard, name, sectors)
        last = {name: heard.of(name)[-1] for name in ("HEARTBEAT", "SECTOR_INFO", "MAP_FILL", "TIMING", "TEAM", "INFO")}

        def value(name, signal):
            found = bus.FILE.named(name).signals[signal]
            return found.named(last[name]) or found.value(last[name])

        self.assertEqual("Mapping", value("HEARTBEAT", "MappingState"))
        self.assertEqual("None", value("HEARTBEAT", "PoseVerdict"))
        self.assertEqual("Active", value("HEARTBEAT", "BusState"))
        self.assertEqual((sectors, "Current", 20), tuple(value("SECTOR_INFO", s) for s in ("SectorCount", "SectorsState", "MaxRange")))
        self.assertEqual((25, 1234, 0), tuple(value("MAP_FILL", s) for s in ("MemoryUsed", "Blocks", "RefusedPoints")))
        self.assertEqual((7, 41), tuple(value("TIMING", s) for s in ("Overruns", "CycleP99")))
        self.assertEqual((2, "Agree"), tuple(value("TEAM", s) for s in ("PeersInReach", "Convergence")))
        self.assertEqual((1, 3), tuple(value("INFO", s) for s in ("LayoutVersion", "RobotId")))

    def test_what_is_reported_is_on_the_bus(self):
        """candump, read by the DBC file alone; classic frames on an interface that has no others."""
        interface = self.interface(fd=False)
        member = self.member(interface)
        heard = bus.listen(interface.name, lambda heard: len(heard.of("INFO")) >= 2)
        self.check_report(heard, 16, fd=False)
        status = member.status()
        self.assertEqual(0, status["socket"]["received"], "own frames come back")
        self.assertGreater(status["socket"]["sent"], 100)
        self.check_counters(status)

    def test_can_fd(self):
        """Two sectors' frames for 32 sectors, with the faster bit rate; and the pose in one frame."""
        interface = self.interface()
        member = self.member(interface, "--fd", "--sectors", 32)
        heard = bus.listen(interface.name, lambda heard: len(heard.of("INFO")) >= 2)
        self.check_report(heard, 32, fd=True)
        self.assertTrue(all(fd for fd, _ in heard.frames[bus.FILE.named("SECTORS_FD_16").id]))
        self.assertFalse(any(fd for fd, _ in heard.frames[bus.FILE.named("HEARTBEAT").id]))
        self.vehicle(interface, fd=True)
        status = bus.until(lambda: (s := member.status())["seen"]["usable"] > 20 and s, "poses by CAN FD")
        self.assertLess(status["seen"]["oldest_us"], 200_001)
        self.check_counters(status)

    def test_poses_and_commands(self):
        interface = self.interface()
        member = self.member(interface)
        vehicle = self.vehicle(interface)
        status = bus.until(lambda: (s := member.status())["seen"]["usable"] > 20 and s, "poses")
        self.assertLess(status["seen"]["off_track_m"], 0.5)
        self.assertEqual(0, status["socket"]["no_stamp"])
        self.assertEqual(1, status["source"])

        def command(name, number):
            identifier, data = vehicle.frame("COMMAND", Command=name, CommandNumber=number)
            bus.cansend(interface.name, f"{identifier:03X}#{data.hex()}")

        for name, number in (("Clear", 4), ("Clear", 4), ("Clear", 4), ("Pause", 5), ("Pause", 5), ("Pause", 5), ("Save", 6)):
            command(name, number)
        bus.until(lambda: member.status()["seen"]["commands"] == [[2, 5]], "the command that was said again")
        identifier, data = vehicle.frame("VEHICLE_STATE", MotionState="Moving")
        bus.cansend(interface.name, f"{identifier:03X}#{data.hex()}")
        # Silence: bridged, then stale.
        vehicle.with_pose = False
        bus.until(lambda: (s := member.status())["seen"]["bridged"] > 0 and s["verdict"] == 2, "odometry instead of poses")
        bus.until(lambda: member.status()["source"] == 0, "an end of bridging")
        vehicle.with_pose = True
        bus.until(lambda: member.status()["source"] == 1, "poses again")
        self.check_counters(member.status())

    def flood(self, interface, seconds, *words):
        process = subprocess.Popen(["cangen", interface.name, "-g", "0", "-i", *words], stdout=subprocess.DEVNULL,
                                   stderr=subprocess.DEVNULL)
        time.sleep(seconds)
        process.terminate()
        process.wait(timeout=bus.LIMIT_S)

    def test_floods(self):
        """At the rate that the machine gives: all identifiers; then ours, with any bytes and any sizes."""
        interface = self.interface()
        member = self.member(interface, "--mode", "pose")
        vehicle = self.vehicle(interface)
        bus.until(lambda: member.status()["seen"]["usable"] > 20, "poses")
        for words in (("-m",), ("-I", "102", "-L", "8"), ("-I", "104"), ("-I", "100", "-L", "4"), ("-I", "106", "-f")):
            before = member.status()
            self.flood(interface, 0.6, *words)
            status = member.status()
            self.check_counters(status)
            with self.subTest(words):
                self.assertGreater(status["inputs"]["frames"], before["inputs"]["frames"])
                # However long no pose came through: one of any bytes would be far off.
                self.assertLess(status["seen"]["off_track_m"], 1.5)
                self.assertEqual([], status["seen"]["commands"])
                self.assertEqual(0, status["relocations"])
                # Whatever is used is what the vehicle said lately.
                self.assertLess(status["seen"]["oldest_us"], 200_001)
        # A loaded machine sends more slowly: until so many were refused.
        bus.until(lambda: self.flood(interface, 0.6, *words) or member.status()["inputs"]["refused"] > 1000, "refused frames")
        status = member.status()
        self.check_counters(status)
        used = status["seen"]["usable"]
        bus.until(lambda: (s := member.status())["seen"]["usable"] > used + 20 and s["source"] == 1, "poses after the flood")
        self.check_counters(member.status())
        self.assertTrue(vehicle.is_alive())

    def test_interface_down_and_gone(self):
        interface = self.interface()
        member = self.member(interface)
        self.vehicle(interface)
        bus.until(lambda: member.status()["source"] == 1, "poses")
        interface.down()
        status = bus.until(lambda: (s := member.status())["bus"] == STATES.index("Down") and s["source"] == 0 and s, "down")
        self.assertGreaterEqual(status["socket"]["went_down"], 1)
        self.assertGreater(status["given_up"], 0)
        interface.up()
        bus.until(lambda: (s := member.status())["source"] == 1 and s["bus"] == STATES.index("Active"), "up again")
        interface.remove()
        bus.until(lambda: (s := member.status())["bus"] == STATES.index("Down") and s["source"] == 0, "gone")
        interface.add()
        status = bus.until(lambda: (s := member.status())["source"] == 1 and s["reopened"] == 1 and s, "come back")
        self.check_counters(status)

    def test_silent_process(self):
        """The heartbeat goes on, but does not say that all is well."""
        interface = self.interface()
        member = self.member(interface)
        state = bus.FILE.named("HEARTBEAT").signals["MappingState"]
        reason = bus.FILE.named("HEARTBEAT").signals["PauseReason"]
        bus.listen(interface.name, lambda heard: "Mapping" in map(state.named, heard.of("HEARTBEAT")))
        member.status("silent")
        heard = bus.listen(interface.name, lambda heard: "Fault" in map(state.named, heard.of("HEARTBEAT")))
        self.assertEqual("Silent", reason.named(heard.of("HEARTBEAT")[-1]))
        heard = bus.listen(interface.name, lambda heard: len(heard.of("SECTOR_INFO")) > 1)
        self.assertEqual("Held", bus.FILE.named("SECTOR_INFO").signals["SectorsState"].named(heard.of("SECTOR_INFO")[-1]))

    def test_error_frames(self):
        """As a controller's driver would report, sent by somebody else."""
        interface = self.interface()
        member = self.member(interface)
        for frame, state, counter in (("20000004#0010000000000000", "Passive", "error_passive"),
                                      # A driver on its way back from passive says no more than a warning.
                                      ("20000004#0008000000000000", "Active", None),
                                      ("20000004#0040000000000000", "Active", None),
                                      ("20000040#0000000000000000", "Off", "bus_off"),
                                      ("20000100#0000000000000000", "Active", "restarted")):
            bus.cansend(interface.name, frame)
            status = bus.until(lambda: (s := member.status())["bus"] == STATES.index(state) and s, state)
            if counter:
                self.assertEqual(1, status["socket"][counter])
        bus.until(lambda: member.status()["socket"]["error_frames"] == 5, "all error frames")
        self.assertEqual(0, status["socket"]["received"])

    def test_full_queue(self):
        """A bus that takes frames more slowly than they are sent: tried again, given up, and never stuck."""
        interface = self.interface()
        member = self.member(interface)
        subprocess.run(["tc", "qdisc", "add", "dev", interface.name, "root", "netem", "delay", "100ms", "limit", "4"], check=True,
                       timeout=bus.LIMIT_S)
        status = bus.until(lambda: (s := member.status())["given_up"] > 5 and s, "frames that are given up")
        self.assertGreater(status["socket"]["no_buffer"], status["given_up"])
        self.assertGreater(status["retried"], 0)
        # A frame is tried at most eleven times.
        self.assertLess(status["socket"]["no_buffer"], 20 * (status["given_up"] + 40))
        subprocess.run(["tc", "qdisc", "del", "dev", interface.name, "root"], check=True, timeout=bus.LIMIT_S)
        before = member.status()["socket"]
        bus.until(lambda: member.status()["socket"]["sent"] > before["sent"] + 50, "frames again")

    def test_refusals(self):
        classic = self.interface(fd=False)
        for words, said in ((("nowhere",), "it does not exist"), (("lo",), "not a CAN interface"),
                            (("a-name-that-is-too-long",), "1 to 15 characters"), ((classic.name, "--fd"), "classic frames only")):
            member = bus.Member(*words)
            self.assertIn(said, member.begins_with)
            self.assertEqual(1, member.close())


if __name__ == "__main__":
    unittest.main()

# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Run by test_node_on_bus.py inside User-Mode Linux: a whole node whose poses come over CAN, and what becomes of it when
the bus, the poses or the clock fail. docs/reference/operations.md names the tests."""
import subprocess
import sys
import time
import unittest

import bus
from node_on_bus import NodeOnBus, running_node, sensor_sender

RANDOM_FRAMES = 10_000


class Mapping(NodeOnBus):
    def test_what_the_vehicle_is_told_is_what_the_sensors_saw(self):
        node = self.start()
        bus.until(lambda: self.bus.value("SECTORS_00", "Sector00Distance") not in (None, "NotAvailable", "NothingFound"), "a wall")
        # The wall is at 5.1 m, the map may have it a voxel nearer, and distances are rounded down to 0.1 m.
        distance_m = self.bus.value("SECTORS_00", "Sector00Distance")
        self.assertLess(distance_m, 5.05)
        self.assertGreater(distance_m, 4.6)
        self.assertEqual(sensor_sender.WALL_CLASS, self.bus.value("SECTORS_00", "Sector00Class"))
        self.assertGreater(self.bus.value("SECTORS_00", "Sector00Confidence"), 0.5)
        self.assertLessEqual(self.bus.value("SECTORS_00", "Sector00FreeUpTo"), 5)
        # To the left of it and to the right.
        for frame, sector in (("SECTORS_00", "Sector01Distance"), ("SECTORS_14", "Sector15Distance")):
            self.assertAlmostEqual(5.0, self.bus.value(frame, sector), delta=0.4)
        for frame, sector in (("SECTORS_04", "Sector04Distance"), ("SECTORS_08", "Sector08Distance")):
            self.assertEqual("NothingFound", self.bus.value(frame, sector))
        # A busy machine may keep a pose waiting for a moment.
        bus.until(lambda: tuple(self.bus.value("SECTOR_INFO", s) for s in ("SectorsState", "SectorCount")) == ("Current", 16), "sectors")
        self.assertEqual(("Good", "Pose", "Active"),
                         tuple(self.bus.value("HEARTBEAT", s) for s in ("PoseVerdict", "PoseSource", "BusState")))
        self.assertGreater(self.bus.value("MAP_FILL", "Blocks"), 0)
        # 20 Hz to 10 Hz, whatever the machine does to both.
        self.bus.times.clear()
        bus.until(lambda: self.bus.count("HEARTBEAT") >= 30, "heartbeats")
        self.assertAlmostEqual(2.0, self.bus.count("SECTOR_INFO") / self.bus.count("HEARTBEAT"), delta=0.2)
        times = self.bus.times[bus.FILE.named("SECTOR_INFO").id]
        print(f"SECTOR_INFO each {1e3 * (times[-1] - times[0]) / (len(times) - 1):.1f} ms", file=sys.stderr)
        report = node.end()
        self.assertEqual(report["mapping"]["cycles"], report["sensors"]["match"]["given"] - report["mapping"]["paused"])
        self.check_counters(report)
        self.wall_is_where_it_is()

    def test_commands(self):
        node = self.start()
        self.command("Pause", 1)
        self.comes_to("Paused", "Command")
        self.assertEqual("Done", self.bus.value("HEARTBEAT", "CommandResult"))
        self.command("Save", 2)
        bus.until(lambda: self.bus.value("HEARTBEAT", "CommandResult") == "Done", "an end of saving")
        self.wall_is_where_it_is()
        self.assertGreater(self.bus.value("MAP_FILL", "Blocks"), 0)
        self.sensors.with_clouds = False
        self.command("Clear", 3)
        self.command("Start", 4)
        bus.until(lambda: self.bus.value("MAP_FILL", "Blocks") == 0, "an empty map")
        self.sensors.with_clouds = True
        self.comes_to("Mapping", "None")
        report = node.end()
        self.assertEqual((1, 1, 4), (report["mapping"]["saves"], report["mapping"]["clears"], report["vehicle"]["commands"]))

    def test_another_process_with_this_robots_number_is_a_fault(self):
        """For 10 s after it was heard last; the obstacles stay those of the robot's own map."""
        self.start()
        (self.folder / "copied").mkdir()
        (self.folder / "copied/robot_0.starts").write_text("5\n")
        twin = running_node.RunningNode(self.folder, running_node.write_config(self.folder, "twin", running_node.sensing("twin"),
                                                                               robot={"state": "copied"}))
        self.addCleanup(twin.close)
        self.comes_to("Fault", "Twin", "another process with this robot's number")
        self.node.says("another process uses the number of robot 0")
        bus.until(lambda: self.bus.value("SECTOR_INFO", "SectorsState") == "Current", "sectors")
        twin.kill()
        self.comes_to("Mapping", "None")

    def test_a_save_on_a_full_disk_is_denied(self):
        subprocess.run(["mount", "-t", "tmpfs", "-o", "size=512k", "full", str(self.folder)], check=True, timeout=bus.LIMIT_S)
        self.addCleanup(subprocess.run, ["umount", "-l", str(self.folder)], check=False)
        node = self.start(output={"report": None})
        room = self.folder / "all"
        try:
            room.write_bytes(bytes(524_288))
        except OSError:
            pass  # All that there was.
        self.command("Save", 1)
        bus.until(lambda: self.bus.value("HEARTBEAT", "CommandResult") == "Denied", "a save that is denied")
        node.says("the map could not be saved: ")
        self.comes_to("Mapping", "None")
        room.unlink()
        self.command("Save", 2)
        bus.until(lambda: self.bus.value("HEARTBEAT", "CommandResult") == "Done", "a save")
        self.wall_is_where_it_is()


class Poses(NodeOnBus):
    def goes_on(self, what):
        self.comes_to("Mapping", "None", f"well again after {what}")

    def test_bad_poses_pause_mapping_and_good_ones_let_it_go_on(self):
        node = self.start()
        vehicle = self.vehicle
        blocks = self.bus.value("MAP_FILL", "Blocks")
        vehicle.with_pose = False
        self.comes_to("Paused", "StalePose", "no poses")
        self.assertEqual("Held", self.bus.value("SECTOR_INFO", "SectorsState"))
        vehicle.with_pose = True
        self.goes_on("no poses")
        vehicle.damaged = True
        self.comes_to("Paused", "StalePose", "damaged frames")
        vehicle.damaged = False
        self.goes_on("damaged frames")
        vehicle.deviation = 1.0
        self.comes_to("Paused", "UncertainPose", "a deviation of 1 m")
        vehicle.deviation = 0.02
        self.goes_on("a deviation of 1 m")
        vehicle.far = True
        self.comes_to("Paused", "CorruptPose", "150 km away")
        vehicle.far = False
        self.goes_on("150 km away")
        vehicle.alternating = True
        self.comes_to("Paused", "JumpingPose", "poses that jump")
        vehicle.alternating = False
        self.goes_on("poses that jump")
        # Wheels that turn while the pose stays.
        vehicle.wheel_speed = 2.0
        self.comes_to("Paused", "FrozenPose", "wheels at 2 m/s and a pose that stays")
        vehicle.wheel_speed = 0.0
        for step in range(1, 11):
            vehicle.x = 0.05 * step
            time.sleep(0.05)
        self.goes_on("a frozen pose")
        report = node.end()
        self.check_counters(report)
        self.assertEqual(0, report["vehicle"]["relocations"])
        self.assertGreaterEqual(report["sensors"]["pauses"], 6)
        # The wall is where it was: nothing was mapped with what was in doubt.
        self.assertGreater(blocks, 0)
        self.wall_is_where_it_is()

    def test_odometry_bridges_for_two_seconds(self):
        self.start(mode="bridging")
        self.vehicle.with_pose = False
        bus.until(lambda: self.bus.value("HEARTBEAT", "PoseSource") == "Odometry", "odometry")
        self.assertEqual("Mapping", self.bus.state()[0])
        self.comes_to("Paused", "StalePose", "no poses, bridged")
        self.vehicle.with_pose = True
        self.goes_on("no poses")

    def test_poses_of_another_frame_wait_for_a_command(self):
        node = self.start()
        # The robot is where it was, and the localisation says that it is elsewhere.
        self.sensors.x_m = lambda: 0.0
        self.vehicle.x = 100.0
        node.says("poses are of another frame")
        bus.until(lambda: self.bus.value("HEARTBEAT", "PoseVerdict") == "Good", "poses that are good again")
        self.comes_to("Paused", "JumpingPose", "another frame")
        self.command("Clear", 1)
        self.goes_on("clear")
        report = node.end()
        self.assertEqual((1, 1), (report["vehicle"]["relocations"], report["mapping"]["clears"]))
        self.wall_is_where_it_is()


class Bus(NodeOnBus):
    def cangen(self, *words):
        """Random bytes at the rate that the machine gives."""
        subprocess.run(["cangen", self.interface.name, "-g", "0", "-i", *words], check=False, timeout=bus.LIMIT_S,
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def test_random_and_malformed_frames_and_a_flood(self):
        node = self.start()
        self.command("Pause", 1)
        self.command("Start", 2)
        time.sleep(1)
        blocks = self.bus.value("MAP_FILL", "Blocks")
        # All identifiers and lengths; then ours, with random bytes of any length, of the right one, and of CAN FD.
        each = RANDOM_FRAMES // 8
        for words in (("-I", "i", "-L", "i"), ("-m",), ("-I", "102", "-L", "8"), ("-I", "103", "-L", "8"), ("-I", "104", "-L", "i"),
                      ("-I", "100", "-L", "4"), ("-I", "105"), ("-I", "106", "-f", "-L", "48")):
            self.cangen(*words, "-n", str(each))
            self.assertIsNone(node.process.poll(), f"it ended: {node.said}")
        begin = time.monotonic()
        flood = subprocess.Popen(["cangen", self.interface.name, "-g", "0", "-i", "-I", "102", "-L", "8"], stdout=subprocess.DEVNULL,
                                 stderr=subprocess.DEVNULL)
        self.comes_to("Paused", "StalePose", "a flood of one's own identifier")
        time.sleep(1)
        flood.terminate()
        flood.wait(timeout=bus.LIMIT_S)
        print(f"flooded for {time.monotonic() - begin:.1f} s", file=sys.stderr)
        self.comes_to("Mapping", "None", "well again after a flood")
        time.sleep(1)
        # No scan was mapped with a pose that is not the vehicle's: there is nothing but the wall.
        self.assertEqual(blocks, self.bus.value("MAP_FILL", "Blocks"))
        report = node.end()
        vehicle = self.check_counters(report)
        print({key: vehicle[key] for key in ("frames", "accepted", "refused", "misshapen", "kernel_dropped")}, file=sys.stderr)
        self.assertGreater(vehicle["refused"], each)
        self.assertGreater(vehicle["misshapen"], 100)
        self.assertEqual((0, 0, 2), (vehicle["relocations"], report["mapping"]["clears"], vehicle["commands"]))
        self.wall_is_where_it_is()

    def test_bus_off(self):
        node = self.start()
        # On a bus that is off nothing comes.
        self.vehicle.silent = True
        time.sleep(0.1)
        bus.cansend(self.interface.name, "20000040#0000000000000000")
        node.says("the bus is off")
        bus.until(lambda: self.bus.value("HEARTBEAT", "BusState") == "Off", "bus off in the heartbeat")
        self.comes_to("Paused", "StalePose", "bus off")
        bus.cansend(self.interface.name, "20000100#0000000000000000")
        self.vehicle.silent = False
        node.says("the bus is active again")
        self.comes_to("Mapping", "None", "well again after bus off")
        self.assertEqual((1, 2), tuple(node.end()["vehicle"][key] for key in ("bus_off", "error_frames")))

    def test_an_interface_that_is_down_and_one_that_is_gone(self):
        node = self.start()
        self.interface.down()
        place = node.says("the bus is down")
        node.says("poses are stale")
        self.interface.up()
        place = node.says("the bus is active again", place)
        self.comes_to("Mapping", "None", "well again after down")
        self.interface.remove()
        place = node.says("the bus is down", place)
        self.interface.add()
        node.says("the bus is active again", place)
        self.bus = self.dump()
        self.comes_to("Mapping", "None", "well again after gone")
        vehicle = self.check_counters(node.end())
        self.assertEqual(1, vehicle["reopened"])
        self.assertGreaterEqual(vehicle["went_down"], 1)

    def test_silent_sensors_are_told(self):
        node = self.start()
        self.sensors.with_clouds = False
        self.comes_to("Paused", "NoSensor", "silent sensors")
        node.says("no scan for ")
        self.sensors.with_clouds = True
        self.comes_to("Mapping", "None", "well again after silent sensors")


class Clock(NodeOnBus):
    def step(self, seconds):
        """The clock of this kernel."""
        time.clock_settime(time.CLOCK_REALTIME, time.time() + seconds)

    def test_a_step_of_the_clock_that_sensors_stamp_with(self):
        node = self.start(clock=time.time)
        for seconds in (3600.0, -7200.0):
            place = node.here()
            frames = self.bus.count("SECTOR_INFO")
            self.step(seconds)
            node.says("the sensors' clock was set", place)
            bus.until(lambda before=frames: self.bus.count("SECTOR_INFO") > before + 50, "sectors after the step")
            self.comes_to("Mapping", "None", f"well again after a step of {seconds:.0f} s")
        report = node.end()
        self.assertEqual(2, report["sensors"]["match"]["clock_steps"])
        self.assertEqual(0, report["vehicle"]["relocations"])
        self.wall_is_where_it_is()


if __name__ == "__main__":
    unittest.main()

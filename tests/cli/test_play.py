# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""play: a dataset as live sensors, heard by a port of ours, recorded and played by LCM's own programs."""
import array
import json
import os
import pathlib
import signal
import subprocess
import time
import unittest

import own_network
from command_case import CommandCase, command_path

URL = "udpm://239.255.76.68:7668?ttl=0&recv_buf_size=4194304"
SCANS = 3
IN_OWN_NETWORK = own_network.enter()


def packed_points(path):
    """x y z of a velodyne file's points."""
    numbers = array.array("f", path.read_bytes())
    del numbers[3::4]
    return numbers.tobytes()


class Play(CommandCase):
    def hear(self, name, count=SCANS, cameras=0):
        """A port in a process of its own, which hears already."""
        folder = self.folder / name
        folder.mkdir()
        process = subprocess.Popen([os.environ["TESSERA_HEAR_SENSORS"], folder, str(count), "20", str(cameras)], text=True,
                                   stdout=subprocess.PIPE)
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        self.assertEqual("ready\n", process.stdout.readline())
        return process, folder

    def heard(self, process, folder):
        said = process.communicate(timeout=60)[0]
        self.assertEqual(0, process.returncode, said)
        return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}

    def logger(self, log):
        """LCM's recorder, which hears already."""
        process = subprocess.Popen(["lcm-logger", "-q", "--flush-interval=1", f"--lcm-url={URL}", log],
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def knock(self, data, log, size):
        """Until the log has more than size bytes."""
        deadline = time.monotonic() + 60
        while not log.exists() or log.stat().st_size <= size:
            self.assertLess(time.monotonic(), deadline, "lcm-logger writes nothing")
            self.done("play", "--dataset", data, "--last", 0, "--messages", "raw", "--poses", "none", "--sensor", 9)
            time.sleep(0.2)

    def test_a_port_hears_the_dataset_live_and_from_a_log(self):
        if not IN_OWN_NETWORK:
            self.skipTest("skipped: no network namespaces are permitted here")
        # For LCM's programs.
        subprocess.run(["ip", "route", "add", "224.0.0.0/4", "dev", "lo"], check=False, capture_output=True)
        self.done("simulate", "--robots", 1, "--scans", SCANS, "--out", "street")
        data = self.folder / "street" / "robot_0"
        log = self.folder / "run.lcm"
        logger = self.logger(log)
        live = self.hear("live")
        # It hears once it has joined, and writes when it hears something more: it is knocked at, by what no port takes.
        knocked = 12 * ((data / "velodyne" / "000000.bin").stat().st_size // 16)
        self.knock(data, log, knocked)
        before = log.stat().st_size
        result = self.done("play", "--dataset", data, "--rate", 5, "--labels", "labels", "--report", "play.json")
        report = json.loads((self.folder / "play.json").read_text())
        self.assertEqual((SCANS, SCANS, 5.0), (report["scans"], report["poses"], report["config"]["rate"]))
        self.assertGreater(report["sent_bytes"], sum(path.stat().st_size for path in (data / "velodyne").iterdir()) * 12 // 16)
        self.assertIn(f"{SCANS} scans and {SCANS} poses sent to", result.stdout)
        self.assert_not_warned(result)
        first = self.heard(*live)
        for scan in range(SCANS):
            self.assertEqual(packed_points(data / "velodyne" / f"{scan:06}.bin"), first[f"{scan}.xyz"])
            self.assertEqual((data / "velodyne" / f"{scan:06}.bin").stat().st_size // 16, len(first[f"{scan}.components"]))
            self.assertGreater(len(set(first[f"{scan}.components"])), 3)
        stamps = [int(first[f"{scan}.txt"].split()[0]) for scan in range(SCANS)]
        self.assertEqual(stamps, sorted(stamps))
        heard = sum(len(content) for content in first.values())
        self.knock(data, log, before + heard)
        # It flushes once a second, when it hears something.
        time.sleep(1.2)
        self.knock(data, log, log.stat().st_size)
        logger.send_signal(signal.SIGINT)
        logger.wait(timeout=20)
        again = self.hear("again")
        player = subprocess.Popen(["lcm-logplayer", "-s", "1", "-l", URL, log], stdout=subprocess.DEVNULL,
                                  stderr=subprocess.DEVNULL)
        self.addCleanup(player.wait)
        self.addCleanup(player.kill)
        self.assertEqual(first, self.heard(*again))

    def test_labels_with_weights_are_heard_as_they_are_in_the_files(self):
        if not IN_OWN_NETWORK:
            self.skipTest("skipped: no network namespaces are permitted here")
        self.done("simulate", "--robots", 1, "--scans", SCANS, "--topk", 3, "--out", "street")
        data = self.folder / "street" / "robot_0"
        live = self.hear("live")
        self.done("play", "--dataset", data, "--labels", "topk")
        heard = self.heard(*live)
        for scan in range(SCANS):
            self.assertEqual(packed_points(data / "velodyne" / f"{scan:06}.bin"), heard[f"{scan}.xyz"])
            words = array.array("I", (data / "topk" / f"{scan:06}.topk").read_bytes())
            self.assertEqual(len(words), len(heard[f"{scan}.components"]))
            self.assertEqual(bytes(word >> 16 for word in words), heard[f"{scan}.label_weights"])

    def test_a_node_gets_all_that_sensors_would_give_it(self):
        """Raw clouds as they are in the files, with times, what three cameras saw, and poses in between."""
        if not IN_OWN_NETWORK:
            self.skipTest("skipped: no network namespaces are permitted here")
        self.done("simulate", "--robots", 1, "--scans", SCANS, "--cameras", "on", "--sweep", "on", "--out", "street")
        data = self.folder / "street" / "robot_0"
        live = self.hear("live", cameras=3)
        # In slow motion, so that it is heard on a busy machine too; images are within 47 ms of their scan at 10 Hz.
        result = self.done("play", "--dataset", data, "--messages", "raw", "--rate", 9.9)
        poses = SCANS * 10 - 9 + 2 * 20
        self.assertIn(f"{SCANS} scans, {3 * SCANS} label images and {poses} poses sent to", result.stdout)
        heard = self.heard(*live)
        stretch = 10 / 9.9
        for scan in range(SCANS):
            stamp, _, scan_poses, *_ = heard[f"{scan}.txt"].split()
            self.assertEqual(packed_points(data / "velodyne" / f"{scan:06}.bin"), heard[f"{scan}.xyz"])
            self.assertEqual(b"", heard[f"{scan}.components"])
            # Poses over the sweep of 100 ms, and those around it.
            self.assertGreaterEqual(int(scan_poses), 10)
            recorded = array.array("f", (data / "times" / f"{scan:06}.bin").read_bytes())
            times = array.array("f", heard[f"{scan}.times"])
            self.assertEqual(len(recorded), len(times))
            self.assertLess(max(abs(stretch * r - t) for r, t in zip(recorded, times)), 1e-6)
            images = [tuple(map(int, line.split())) for line in heard[f"{scan}.images"].decode().splitlines()]
            self.assertEqual([(0, 640, 384), (1, 640, 384), (2, 640, 480)], [(camera, *size) for camera, _, *size in images])
            for (camera, taken, width, height), offset_ms in zip(images, (-31, 18, -47)):
                self.assertAlmostEqual(stretch * offset_ms, 1e-3 * (taken - int(stamp)), delta=0.01)
                image = heard[f"{scan}.image{camera}"]
                self.assertEqual(width * height, len(image))
                self.assertGreater(len(set(image)), 3)
                self.assertLess(max(image), 20)

    def test_labelled_clouds_stay_as_measured_if_they_are_not_to_be_deskewed(self):
        if not IN_OWN_NETWORK:
            self.skipTest("skipped: no network namespaces are permitted here")
        self.done("simulate", "--robots", 1, "--scans", SCANS, "--sweep", "on", "--out", "street")
        data = self.folder / "street" / "robot_0"
        for number, options in enumerate((("--deskew", "off"), ())):
            with self.subTest(options):
                live = self.hear(f"live_{number}")
                self.done("play", "--dataset", data, "--rate", 5, *options)
                heard = self.heard(*live)
                for scan in range(SCANS):
                    measured = packed_points(data / "velodyne" / f"{scan:06}.bin")
                    self.assertEqual(bool(options), measured == heard[f"{scan}.xyz"])
                    self.assertEqual(b"", heard[f"{scan}.times"])

    def test_a_loop_drives_back_as_if_time_ran_the_other_way(self):
        if not IN_OWN_NETWORK:
            self.skipTest("skipped: no network namespaces are permitted here")
        self.done("simulate", "--robots", 1, "--scans", SCANS, "--cameras", "on", "--sweep", "on", "--out", "street")
        data = self.folder / "street" / "robot_0"
        live = self.hear("live", count=2 * SCANS + 1, cameras=3)
        player = subprocess.Popen([command_path(), "play", "--dataset", data, "--messages", "raw", "--rate", "9.9", "--loop"],
                                  stdout=subprocess.PIPE, text=True)
        self.addCleanup(player.stdout.close)
        self.addCleanup(player.wait)
        self.addCleanup(player.kill)
        heard = self.heard(*live)
        self.assertIsNone(player.poll())
        self.assertIn(f"{SCANS} scans are sent forward and backward", player.stdout.readline())
        stretch = 10 / 9.9
        order = [*range(SCANS), *reversed(range(SCANS)), 0]
        stamps = [int(heard[f"{i}.txt"].split()[0]) for i in range(len(order))]
        self.assertEqual(stamps, sorted(set(stamps)))
        for i, scan in enumerate(order):
            sign = -1 if SCANS <= i < 2 * SCANS else 1
            self.assertEqual(packed_points(data / "velodyne" / f"{scan:06}.bin"), heard[f"{i}.xyz"])
            recorded = array.array("f", (data / "times" / f"{scan:06}.bin").read_bytes())
            times = array.array("f", heard[f"{i}.times"])
            self.assertLess(max(abs(sign * stretch * r - t) for r, t in zip(recorded, times)), 1e-6)
            for line, offset_ms in zip(heard[f"{i}.images"].decode().splitlines(), (-31, 18, -47)):
                taken = int(line.split()[1])
                self.assertAlmostEqual(sign * stretch * offset_ms, 1e-3 * (taken - stamps[i]), delta=0.01)

    def test_without_a_bus_there_is_no_vehicle(self):
        self.done("simulate", "--robots", 1, "--scans", 1, "--out", "street")
        play = ("play", "--dataset", self.folder / "street" / "robot_0", "--poses")
        self.refused(*play, "can", saying=("--can",))
        self.refused(*play, "lcm", "--can", "can0", saying=("--poses can",))
        self.refused(*play, "can", "--can", "nocan9", saying=("nocan9", "ip -details link show type can"))
        self.refused(*play, "can", "--can", "nocan9", "--can-base", 100, saying=("100", "multiple of 32"))
        self.refused(*play, "can", "--can", "nocan9", "--can-base", 2048, saying=("2048",))

    def test_bad_usage(self):
        self.done("simulate", "--robots", 1, "--scans", 1, "--out", "street")
        data = self.folder / "street" / "robot_0"
        for option, value in (("--rate", "0"), ("--rate", "nan"), ("--rate", "fast"), ("--messages", "some"),
                              ("--poses", "bus"), ("--clock", "sun"), ("--labels", "none"), ("--labels", "nowhere"),
                              ("--url", "udpm://239.255.76.68:7668?ttl=1"), ("--url", "memq://"), ("--interface", "eth99"),
                              ("--sensor", "x"), ("--first", "7")):
            with self.subTest(option=option, value=value):
                self.refused("play", "--dataset", data, f"{option}={value}", saying=(value,) if option != "--first" else ())
        self.refused("play", "--dataset", "nowhere", saying=("nowhere",))
        self.refused("play", "--dataset", data, "--loop", "--report", "play.json", saying=("--loop", "--report"))
        self.refused("play", "--dataset", data, "--report", data / "poses.txt", saying=("poses.txt",))


if __name__ == "__main__":
    unittest.main()

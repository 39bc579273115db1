# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Other threads run while the map works, and any thread may call anything."""
import sys
import threading
import time

import numpy as np
from conftest import map_of

import tessera


class Counter:
    """A thread that counts whenever it gets the interpreter, and gives it back each time."""

    def __init__(self):
        self.count, self.running = 0, True
        self.thread = threading.Thread(target=self.run)

    def run(self):
        while self.running:
            self.count += 1
            time.sleep(0)

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.running = False
        self.thread.join()


def progress_during(work):
    """What a counting thread does during one call. Python takes the interpreter from who runs bytecodes every 5 ms, which is
    made longer than any test: so the other one gets it only where the call itself lets it go."""
    interval = sys.getswitchinterval()
    sys.setswitchinterval(100.0)
    try:
        with Counter() as counter:
            before = counter.count
            work()
            return counter.count - before
    finally:
        sys.setswitchinterval(interval)


def test_work_leaves_the_interpreter_to_others(street, tmp_path):
    scan = tessera.Dataset(street / "robot_0", first=0, last=0)[0]
    made = tessera.LocalMap(memory_bytes=128 << 20)
    path = tmp_path / "a.tsm"
    places = np.random.default_rng(1).uniform(-20, 20, (200_000, 3))
    other = tessera.LocalMap(memory_bytes=128 << 20, robot=1)
    other.integrate(scan.points, scan.components)
    for work in (lambda: made.integrate(scan.points, scan.components), lambda: made.query(places), lambda: made.voxels(),
                 lambda: made.save(path), lambda: tessera.load(path), made.digest, lambda: tessera.fuse([made, other]),
                 lambda: tessera.align(made, other), lambda: made.cast_rays(np.zeros(3), places, 20.0), lambda: made.nearest_occupied(places[:2000], 5.0),
                 lambda: tessera.Evaluation(made).add(scan.points, scan.components),
                 lambda: tessera.Dataset(street / "robot_0")[0]):
        # What takes a millisecond may be over before the other thread wakes up.
        assert any(progress_during(work) > 0 for _ in range(200))
    assert progress_during(lambda: sum(range(3_000_000))) == 0, "this test would not notice"


def test_readers_and_writers_together_lose_nothing(street):
    dataset = tessera.Dataset(street / "robot_0")
    expected = map_of(dataset)[0].digest()
    scans = [dataset[i] for i in range(len(dataset))]
    made = map_of(dataset)[0]
    made.clear()
    places = np.random.default_rng(1).uniform(-20, 20, (20_000, 3))
    done, faults = threading.Event(), []

    def read():
        while not done.is_set():
            found = made.query(places)
            if np.any((found.state == 0) & (found.evidence > 0)):
                faults.append("a voxel that was never seen has evidence")
            made.box((-5, -5, -2), (5, 5, 2), occupied_only=True)

    def share(sharer):
        now_us = 0
        while not done.is_set():
            now_us += 50_000
            sharer.tick(now_us)
            sharer.global_map.query(places[:100])

    threads = [threading.Thread(target=read), threading.Thread(target=share, args=(tessera.Sharer(made, fusion_memory_bytes=64 << 20),))]
    for thread in threads:
        thread.start()
    for scan in scans:
        made.integrate(scan.points, scan.components, scan.T_map_sensor)
    done.set()
    for thread in threads:
        thread.join()
    assert faults == [] and made.digest() == expected

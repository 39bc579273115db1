# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Maps that become one: all at once as the command does it, and by datagrams over any transport."""
import random

import numpy as np
import pytest
from conftest import sharer_of

import tessera

TICK_US = 50_000
MODES = ("contractive", "paper", "none")


def exchange(sharers, pick=lambda datagrams: datagrams, ticks=2000):
    """Carries datagrams between all of them until they have the same, and brings their global maps up to date."""
    now_us = 0
    for _ in range(ticks):
        now_us += TICK_US
        for one in sharers:
            for datagram in pick(one.tick(now_us)):
                assert isinstance(datagram, bytes) and 0 < len(datagram) <= 1392
                for other in sharers:
                    if other is not one:
                        other.receive(datagram, now_us)
        if all(s.idle and s.complete for s in sharers) and len({s.digest() for s in sharers}) == 1:
            for sharer in sharers:
                sharer.finish()
            return now_us
    raise AssertionError([s.report() for s in sharers])


@pytest.fixture(scope="module")
def robots(street, frame):
    """Small maps of one place, each in a frame of its own."""
    dataset = tessera.Dataset(street / "robot_0")
    T_first_second = np.array([[0.0, -1, 0, 3], [1, 0, 0, -2], [0, 0, 1, 0.5], [0, 0, 0, 1]])
    made = []
    for robot, T in enumerate((np.eye(4), T_first_second)):
        one = tessera.LocalMap(dataset.classes, resolution_m=0.2, memory_bytes=64 << 20, max_range_m=8.0, robot=robot,
                               T_global_map=frame @ T)
        one.integrate(dataset[robot].points, dataset[robot].components, np.linalg.inv(T) @ dataset[robot].T_map_sensor)
        made.append(one)
    return made


@pytest.mark.parametrize("mode", MODES)
def test_fuse_is_the_command(maps, files, command, street, tmp_path, mode):
    report = command("fuse", *(path for _, path in files), "--diffusion", mode, "--out", tmp_path / "g.tsm",
                     report=tmp_path / "g.json")
    fused = tessera.fuse(maps, diffusion=mode)
    assert fused.digest() == report["digest"] == fused.report["digest"]
    assert fused.kind == "global" and fused.settings["diffusion"] == mode
    for key in ("voxels", "overlap_voxels", "iterations", "residual", "mean_variance", "alignment"):
        assert fused.report[key] == report[key]
    fused.save(tmp_path / "own.tsm")
    assert (tmp_path / "own.tsm").read_bytes() == (tmp_path / "g.tsm").read_bytes()
    mixed = tessera.fuse([files[0][1], str(files[1][1])], diffusion=mode)
    assert mixed.digest() == fused.digest() == tessera.fuse(maps[::-1], diffusion=mode).digest()
    memory = 256 << 20
    assert tessera.fuse(maps, diffusion=mode, memory_bytes=memory).digest() == fused.digest()


def test_frames_are_given_or_the_maps_own(maps, recwarn):
    own = [m.T_global_map for m in maps]
    digest = tessera.fuse(maps).digest()
    assert tessera.fuse(maps, own).digest() == tessera.fuse(maps, [None, own[1]]).digest() == digest
    assert not recwarn.list
    moved = own[1].copy()
    moved[0, 3] += 0.4
    with pytest.warns(UserWarning, match="are misaligned"):
        assert tessera.fuse(maps, [None, moved]).digest() != digest


def test_frames_that_are_not_found_are_no_frames(wall):
    made = [tessera.LocalMap(tessera.ClassTable(["road", "wall"]), memory_bytes=32 << 20, max_points=4096, robot=robot) for robot in (0, 1)]
    for one in made:
        one.integrate(*wall)
    with pytest.raises(tessera.Error, match="could not be placed in the frame of"):
        tessera.fuse(made, align=True)


def test_maps_of_which_none_has_a_frame_are_fused_with_a_warning(wall):
    made = [tessera.LocalMap(tessera.ClassTable(["road", "wall"]), memory_bytes=32 << 20, max_points=4096, robot=robot) for robot in (0, 1)]
    for one in made:
        one.integrate(*wall)
    with pytest.warns(UserWarning) as found:
        tessera.fuse(made)
    assert [str(one.message) for one in found] == [
        "none of the 2 maps has a T_global_map: their frames are taken for the same one; where they are not, have them found (align), or give transforms, one for each"]
    with pytest.warns(UserWarning, match="has no T_global_map; its frame is taken for the global one"):
        tessera.fuse(made, [np.eye(4), None])


def test_what_cannot_be_fused(maps, files, small, tmp_path):
    fused = tessera.fuse(maps, diffusion="none")
    fused.save(tmp_path / "g.tsm")
    for bad, words in (([maps[0]], "at least two"), ([maps[0], maps[0]], "named twice"), ([files[0][1], files[0][1]], "named twice"),
                       ([maps[0], fused], "global map"), ([maps[0], tmp_path / "g.tsm"], "global map"),
                       ([maps[0], small], "resolution"), ([maps[0], tmp_path / "none.tsm"], "none.tsm")):
        with pytest.raises(tessera.InputError, match=words):
            tessera.fuse(bad)
    for arguments, words in (({"diffusion": "heat"}, "diffusion heat"), ({"edge": "sharp"}, "edge sharp"), ({"alpha": 1.0}, "alpha 1"),
                             ({"iterations": 17}, "iterations 17"), ({"diffusion_length_m": 9.0}, "diffusion_length_m"),
                             ({"counts": "few"}, "counts few"), ({"memory_bytes": 1 << 20}, "memory_bytes 1048576"),
                             ({"transforms": [None]}, "1 transforms for 2 maps"), ({"transforms": [None, np.eye(3)]}, "transforms"),
                             ({"transforms": [None, np.full((4, 4), np.nan)]}, "transforms")):
        with pytest.raises(tessera.InputError, match=words):
            tessera.fuse(maps, **arguments)
    with pytest.raises(TypeError):
        tessera.fuse([maps[0], 7])


@pytest.mark.parametrize("mode", MODES)
def test_two_robots_have_the_same_global_map(robots, mode):
    sharers = [sharer_of(robot, diffusion=mode) for robot in robots]
    exchange(sharers)
    a, b = (s.global_map for s in sharers)
    assert a.kind == "global" and a.digest() == b.digest()
    here = robots[0].voxels(occupied_only=True).center[::50]
    T = robots[0].T_global_map
    found = a.query(here @ T[:3, :3].T + T[:3, 3])
    assert (found.state == tessera.State.OCCUPIED).mean() > 0.8
    report = sharers[0].report()
    assert (report["contributions"], report["peers"], report["refused_tag"]) == (2, 1, 0)
    assert report["global"]["overlap_voxels"] > 0 and report["global"]["refused_storage"] == 0
    assert {(c["robot"], c["own"], c["complete"]) for c in report["contributions_by_id"]} == {(0, True, True), (1, False, True)}


def test_losses_repeats_and_order_do_not_matter(robots):
    chance = random.Random(4)

    def pick(datagrams):
        kept = [d for d in datagrams if chance.random() > 0.2]
        kept += [d for d in kept if chance.random() < 0.1]
        chance.shuffle(kept)
        return kept

    undisturbed, disturbed = ([sharer_of(robot, diffusion="none") for robot in robots] for _ in range(2))
    exchange(undisturbed)
    exchange(disturbed, pick)
    assert disturbed[1].global_map.digest() == undisturbed[0].global_map.digest()


def test_keys_are_those_of_the_fleet(robots, command, tmp_path):
    keys = tmp_path / "keys"
    command("key", "new", "--fleet", tmp_path / "fleet.key")
    command("key", "new", "--fleet", tmp_path / "other.key")
    for robot in (0, 1):
        command("key", "new", "--robot", robot, "--dir", keys)
    public = tmp_path / "fleet.pub"
    public.write_text("".join((keys / f"robot_{robot}.pub").read_text() for robot in (0, 1)))
    public.chmod(0o600)

    def keyed(robot, **arguments):
        return sharer_of(robots[robot], **{"diffusion": "none", "fleet_key": tmp_path / "fleet.key",
                                           "robot_secret": keys / f"robot_{robot}.key", "robot_public_keys": public, **arguments})

    members = [keyed(0), keyed(1)]
    exchange(members)
    assert members[0].global_map.digest() == members[1].global_map.digest()
    assert [m.report()["peers"] for m in members] == [1, 1]
    # Who has no key, or another one, is not heard; who does not sign is heard of nothing that counts.
    for stranger in (sharer_of(robots[1]), keyed(1, fleet_key=str(tmp_path / "other.key"))):
        member = keyed(0)
        datagrams = stranger.tick(TICK_US)
        for datagram in datagrams:
            member.receive(datagram, TICK_US)
        refused = member.report()["refused_tag"] + member.report()["refused_mission"]
        assert 0 < len(datagrams) == refused and member.report()["peers"] == 0
    forger, member = keyed(1, robot_secret=None, robot_public_keys=None), keyed(0)
    for n in range(1, 20):
        for datagram in forger.tick(n * TICK_US):
            member.receive(datagram, n * TICK_US)
    assert (member.report()["refused_tag"], member.report()["records_taken"]) == (0, 0)
    assert member.report()["refused_signature"] > 0
    empty = tmp_path / "empty.key"
    empty.touch(0o600)
    for arguments, words in (({"robot_secret": keys / "robot_1.key"}, "robot_1.key is of robot 1, and this is robot 0"),
                             ({"robot_secret": None}, "name robot_secret too"), ({"robot_public_keys": None}, "name robot_public_keys too"),
                             ({"fleet_key": public}, "fleet.pub"), ({"fleet_key": tmp_path / "absent.key"}, "absent.key"),
                             ({"fleet_key": ""}, "^fleet_key is empty"), ({"robot_secret": ""}, "^robot_secret is empty"),
                             ({"mission": ""}, "^mission is empty"), ({"mission": 65 * "x"}, "is over 64 bytes"),
                             ({"fleet_key": None, "robot_secret": None, "robot_public_keys": None, "mission": "m"}, "without a key"),
                             ({"fleet_key": empty}, "make one with tessera key new --robots N --dir DIR$")):
        with pytest.raises(tessera.InputError, match=words):
            keyed(0, **arguments)


def test_what_was_said_in_another_mission_is_not_heard(robots, command, tmp_path):
    keys = tmp_path / "keys"
    command("key", "new", "--robots", 2, "--dir", keys)

    def in_mission(robot, mission):
        return sharer_of(robots[robot], diffusion="none", fleet_key=keys / "fleet.key", robot_public_keys=keys / "fleet.pub",
                         robot_secret=keys / f"robot_{robot}.key", mission=mission)

    member = in_mission(0, None)
    datagrams = in_mission(1, "yesterday").tick(TICK_US)
    for datagram in datagrams:
        member.receive(datagram, TICK_US)
    assert 0 < len(datagrams) == member.report()["refused_mission"] and member.report()["peers"] == 0
    members = [in_mission(robot, "today") for robot in (0, 1)]
    exchange(members)
    assert [m.report()["peers"] for m in members] == [1, 1]


def test_any_bytes_may_arrive(robots):
    sharer = sharer_of(robots[0])
    announcement = 1
    other = next(datagram for datagram in sharer_of(robots[1]).tick(TICK_US) if datagram[3] == announcement)
    flipped = bytearray(other)
    flipped[len(flipped) // 2] ^= 1
    for bytes_ in (b"", b"x", bytes(1392), bytes(100_000), flipped, memoryview(other)[:-1], np.frombuffer(other, np.uint8)[:40]):
        sharer.receive(bytes_, TICK_US)
    assert sharer.report()["received"] == 7 == sum(sharer.report()[k] for k in ("refused_size", "refused_format", "refused_tag"))
    sharer.receive(bytearray(other), TICK_US)
    sharer.receive(memoryview(other), TICK_US)
    assert sharer.report()["peers"] == 1
    for bad in (memoryview(other)[::2], np.zeros((2, 2), np.uint8), np.zeros(4, np.float32)):
        with pytest.raises(TypeError, match="without gaps"):
            sharer.receive(bad)
    with pytest.raises(TypeError):
        sharer.receive("text")


def test_a_frame_moves_what_was_said(robots):
    there = robots[1].T_global_map.copy()
    there[:3, 3] += [0.6, -0.4, 0.2]
    moved, placed = ([sharer_of(robot, diffusion="none") for robot in robots] for _ in range(2))
    exchange(moved)
    before, datagrams = moved[0].global_map.digest(), moved[1].report()["fresh_chunks"]
    moved[1].set_frame(there)
    exchange(moved)
    assert moved[1].report()["fresh_chunks"] == datagrams
    placed[1] = sharer_of(robots[1], diffusion="none", T_global_map=there)
    exchange(placed)
    assert before != moved[0].global_map.digest() == placed[0].global_map.digest()
    with pytest.raises(tessera.InputError):
        moved[1].set_frame(np.zeros((4, 4)))
    with pytest.raises(tessera.InputError):
        moved[1].set_frame(there, submap=7)


def test_robots_that_leave_and_that_are_excluded(robots):
    sharers = [sharer_of(robot, diffusion="none") for robot in robots]
    exchange(sharers)
    alone = sharer_of(robots[0], diffusion="none")
    exchange([alone])
    sharers[1].leave()
    sharers[0].exclude(1)
    sharers[0].finish()
    assert sharers[0].global_map.digest() == alone.global_map.digest()
    with pytest.raises(tessera.InputError):
        sharers[0].exclude(0)


def test_settings_of_sharers_are_checked(robots):
    for arguments, words in (({"diffusion": "heat"}, "heat"), ({"counts": "few"}, "few"), ({"fusion_memory_bytes": 1 << 20}, "fusion_memory_bytes"),
                             ({"T_global_map": np.zeros((4, 4))}, "T_global_map"), ({"alpha": 2.0}, "alpha"), ({"tick_ms": 0}, "tick_ms")):
        with pytest.raises(tessera.InputError, match=words):
            sharer_of(robots[0], **arguments)
    with pytest.raises(TypeError):
        tessera.Sharer(None)


def test_the_global_map_outlives_its_sharer(robots):
    sharer = sharer_of(robots[0], diffusion="none")
    exchange([sharer])
    kept, digest = sharer.global_map, sharer.global_map.digest()
    del sharer
    assert kept.digest() == digest

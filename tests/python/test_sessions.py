# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Maps of earlier days: loaded from files, shared beside today's, removed."""
import numpy as np
import pytest
from conftest import sharer_of
from test_sharing import exchange

import tessera

PLACE = np.array([[30.05, 0.05, 0.05]], dtype=np.float32)


def wall_at(x_m, robot, **settings):
    """A robot's map of a wall."""
    one = tessera.LocalMap(tessera.ClassTable(["road", "wall"]), memory_bytes=32 << 20, max_points=4096, robot=robot, resolution_m=0.1,
                           **settings)
    y, z = np.meshgrid(np.arange(-1, 1, 0.1) + 0.05, np.arange(-1, 1, 0.1) + 0.05)
    points = np.stack([np.full(y.size, x_m + 0.05), y.ravel(), z.ravel()], axis=1).astype(np.float32)
    pose = np.eye(4)
    pose[0, 3] = x_m - 5.0
    for _ in range(20):
        one.integrate(points - pose[:3, 3].astype(np.float32), np.full(y.size, 2, dtype=np.uint8), pose)
    return one


@pytest.fixture(scope="module")
def yesterday(tmp_path_factory):
    path = tmp_path_factory.mktemp("yesterday") / "yesterday.tsm"
    one = wall_at(30.0, 7)
    one.save(path)
    return path, one.digest()


def test_a_session_counts_once_and_can_be_removed(yesterday):
    path, digest = yesterday
    sharers = [sharer_of(wall_at(5.0, robot)) for robot in (0, 1)]
    exchange(sharers)
    without = sharers[0].global_map.digest()
    numbers = [sharer.load_session(path, weight, date_s=1764115200) for sharer, weight in zip(sharers, (0.25, 1.0))]
    assert numbers == [0, 0]
    exchange(sharers)
    loaded = sharers[0].global_map.digest()
    assert loaded == sharers[1].global_map.digest() != without
    assert sharers[1].sessions == [{"session": 0, "digest": digest, "date_s": 1764115200, "weight": 1.0,
                                    "blocks": sharers[0].sessions[0]["blocks"], "refused_blocks": 0}]
    heard = [c["session"] for c in sharers[1].report()["contributions_by_id"] if "session" in c]
    assert sorted((one["digest"], one["weight"]) for one in heard) == [(digest, 0.25), (digest, 1.0)]
    # The lowest number's counts: by a quarter.
    weights = [sharers[1].global_map.query(PLACE).evidence[0]]
    sharers[0].remove_session(0)
    exchange(sharers)
    weights.append(sharers[1].global_map.query(PLACE).evidence[0])
    assert weights[1] == pytest.approx(4 * weights[0], rel=1e-4) or weights[1] == pytest.approx(25.0, rel=1e-4)
    assert sharers[0].sessions == []
    sharers[1].remove_session(0)
    exchange(sharers)
    assert [sharer.global_map.digest() for sharer in sharers] == [without] * 2
    assert sharers[1].load_session(path) == 1


def test_what_cannot_be_a_session(yesterday, tmp_path):
    path, _ = yesterday
    sharer = sharer_of(wall_at(5.0, 0))
    cut = tmp_path / "cut.tsm"
    cut.write_bytes(path.read_bytes()[:-50])
    coarse = tmp_path / "coarse.tsm"
    tessera.LocalMap(tessera.ClassTable(["road", "wall"]), memory_bytes=32 << 20, resolution_m=0.2).save(coarse)
    far = np.eye(4)
    far[0, 3] = 1e9
    for arguments, words in (((tmp_path / "none.tsm",), "none.tsm"), ((cut,), "cut.tsm"), ((coarse,), "has resolution 0.2"),
                             ((path, 0.0), "weight"), ((path, 1.5), "weight"), ((path, float("nan")), "weight"), ((path, 0.5, far), "outside of the grid")):
        with pytest.raises(tessera.InputError, match=words):
            sharer.load_session(*arguments)
    assert sharer.sessions == []
    sharer.load_session(path)
    with pytest.raises(tessera.InputError, match="shared already"):
        sharer.load_session(path)
    found = tessera.Sharer(wall_at(5.0, 0), fusion_memory_bytes=64 << 20, frames="found")
    with pytest.raises(tessera.InputError, match="sessions need a robot whose frame is known: frames is found"):
        found.load_session(path)
    for number in (1, 70000):
        with pytest.raises(tessera.InputError, match=f"session {number} does not exist"):
            sharer.remove_session(number)


def test_fuse_takes_sessions(yesterday, tmp_path):
    path, digest = yesterday
    today = wall_at(5.0, 0)
    alone = tessera.fuse([today, wall_at(5.0, 1)], diffusion="none")
    fused = {weight: tessera.fuse([today], sessions=[tessera.Session(path, weight, date_s=1764115200)], diffusion="none")
             for weight in (0.25, 1.0)}
    evidence = [one.query(PLACE).evidence[0] for one in fused.values()]
    assert evidence[1] == pytest.approx(4 * evidence[0], rel=1e-4) or evidence[1] == pytest.approx(25.0, rel=1e-4)
    assert alone.query(PLACE).evidence[0] == 0
    report = fused[0.25].report
    (session,) = report["sessions"]
    assert (session["digest"], session["date"], session["weight"]) == (digest, "2025-11-26T00:00:00Z", 0.25)
    assert [one["robot"] for one in report["contributions"]] == [0]
    assert report["config"]["session"] == [f"{path}:0.25"]
    # As a sharer has it; the default weight; and where it is moved to.
    sharer = sharer_of(today)
    sharer.load_session(path, 0.25)
    exchange([sharer])
    assert sharer.global_map.query(PLACE).evidence[0] == pytest.approx(evidence[0], rel=0.11)  # rounded for the wire
    assert tessera.fuse([today], sessions=[path], diffusion="none").report["sessions"][0]["weight"] == 0.5
    moved = np.eye(4)
    moved[1, 3] = 40.0
    at = tessera.fuse([today], sessions=[tessera.Session(path, 0.25, moved)], diffusion="none")
    assert at.query(PLACE).evidence[0] == 0
    assert at.query(PLACE + np.float32([[0, 40, 0]])).evidence[0] == pytest.approx(evidence[0], rel=1e-6)
    # The file has what it was made of, as that of the command.
    fused[0.25].save(tmp_path / "global.tsm")
    assert tessera.fuse([today], sessions=[tessera.Session(path, 0.25, date_s=1764115200)], diffusion="none").digest() == fused[0.25].digest()


def test_what_fuse_does_not_take_as_a_session(yesterday, tmp_path):
    path, _ = yesterday
    today = wall_at(5.0, 0)
    copy = tmp_path / "copy.tsm"
    copy.write_bytes(path.read_bytes())
    coarse = tmp_path / "coarse.tsm"
    tessera.LocalMap(tessera.ClassTable(["road", "wall"]), memory_bytes=32 << 20, resolution_m=0.2).save(coarse)
    for sessions, words in (([path, copy], "has the same content as"), ([coarse], "has resolution 0.2"), ([tmp_path / "none.tsm"], "none.tsm"),
                            ([path] * 9, "sessions is given 9 times; give at most 8")):
        with pytest.raises(tessera.InputError, match=words):
            tessera.fuse([today], sessions=sessions)
    with pytest.raises(tessera.InputError, match="at least two"):
        tessera.fuse([], sessions=[path, copy])
    for weight in (0.0, 1.5, float("nan")):
        with pytest.raises(tessera.InputError, match="weight"):
            tessera.Session(path, weight)
    with pytest.raises(tessera.InputError, match="T_global_map"):
        tessera.Session(path, 0.5, np.ones((4, 4)))
    with pytest.raises(TypeError):
        tessera.fuse([today], sessions=[7])

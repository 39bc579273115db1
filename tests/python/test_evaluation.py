# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""How good a map is: the figures of `tessera eval`."""
import numpy as np
import pytest

import tessera


@pytest.fixture(scope="module")
def expected(files, street, command, tmp_path_factory):
    return command("eval", "--map", files[0][1], "--dataset", street / "robot_0", report=tmp_path_factory.mktemp("eval") / "e.json")


@pytest.mark.parametrize("raw", [False, True])
def test_the_figures_are_the_commands(maps, street, expected, raw):
    dataset = tessera.Dataset(street / "robot_0")
    evaluation = tessera.Evaluation(maps[0])
    for i, scan in enumerate(dataset):
        if raw:
            truth, given = (np.fromfile(street / f"robot_0/{folder}/{scan.number:06d}.label", np.uint32)
                            for folder in ("labels", "predictions"))
        else:
            truth, given = dataset.labels(i), scan.components
        evaluation.add(scan.points, truth, scan.T_map_sensor, given)
    report = evaluation.report()
    for key in ("mean_iou", "iou", "input_mean_iou", "input_iou", "coverage", "coverage_any", "accuracy", "calibration_error",
                "brier_score", "risk_coverage_area", "by_label", "points", "max_range", "non_finite", "counts"):
        assert report[key] == expected[key], key
    for name in ("mean_iou", "coverage", "accuracy", "calibration_error", "brier_score", "risk_coverage_area"):
        assert getattr(evaluation, name) == expected[name] > 0


def test_by_hand(small, wall):
    points, labels = wall
    small.integrate(points, labels)
    evaluation = tessera.Evaluation(small, max_range_m=0)
    truth = labels.copy()
    truth[:100] = 2   # The map says road there.
    truth[-50:] = 3   # Unlabelled: passed over.
    evaluation.add(points, truth)
    report = evaluation.report()
    assert report["points"] == len(points) - 50
    assert report["accuracy"] == pytest.approx((len(points) - 150) / (len(points) - 50), abs=0.02)
    assert report["input_mean_iou"] is None and set(report["iou"]) == {"road", "wall"}
    evaluation.add(np.array([[np.nan, 0, 0], [90, 0, 0]], np.float32), np.array([1, 1], np.uint8))
    with pytest.warns(UserWarning, match="1 point left out: coordinates that are not finite"):
        assert evaluation.report()["non_finite"] == 1
    assert evaluation.report()["points"] == report["points"] + 1


def test_farther_points_are_left_out(small, wall):
    points, labels = wall
    small.integrate(points, labels)
    near, far = tessera.Evaluation(small, max_range_m=3.0), tessera.Evaluation(small)
    for evaluation in (near, far):
        evaluation.add(points, labels)
    assert near.report()["points"] == (np.linalg.norm(points, axis=1) <= 3.0).sum() < far.report()["points"]
    assert far.report()["max_range"] == 40.0


def test_what_makes_the_figures_worth_little_is_warned_of(small, wall, recwarn):
    """What `tessera eval` prints, once for what was added."""
    points, labels = wall
    unlabelled = np.full_like(labels, 3)
    small.integrate(points, unlabelled)
    evaluation = tessera.Evaluation(small, max_range_m=0)
    with pytest.warns(UserWarning, match="no point has labelled truth in range"):
        assert evaluation.mean_iou == 0
    evaluation.add(points, labels)
    with pytest.warns(UserWarning, match="the map has no label, so that every point counts as wrong"):
        evaluation.report()
    recwarn.clear()
    evaluation.report()
    assert evaluation.coverage == 0
    assert not recwarn
    far = points + np.array([100, 0, 0], np.float32)
    evaluation.add(np.concatenate([far, far, [[np.nan, 0, 0]]]).astype(np.float32), np.concatenate([labels, labels, [1]]).astype(np.uint8))
    evaluation.report()
    assert [str(w.message).partition(":")[0] for w in recwarn] == [
        "1 point left out", "the map has no label, so that every point counts as wrong",
        "only 33.3 % of the points are in occupied voxels of the map"]


def test_ids_in_no_class_are_warned_of_once(small, wall, recwarn):
    points, labels = wall
    classes = tessera.ClassTable.parse("".join(
        f'[[class]]\nid = {i}\nname = "{n}"\ncolor = [0, 0, {i}]\nraw = [{i * 10}]\n' for i, n in ((1, "road"), (2, "wall"))))
    local = tessera.LocalMap(classes=classes)
    local.integrate(points, labels)
    evaluation = tessera.Evaluation(local, max_range_m=0)
    raw = np.where(labels == 1, 10, 20).astype(np.uint32)
    for _ in range(2):
        evaluation.add(points, raw, labels=np.full_like(raw, 7))
    assert [str(w.message) for w in recwarn] == [
        f"{len(points)} points of labels with class ids that are in no class (7); taken as unlabelled"]
    assert evaluation.report()["unknown_ids"] == 2 * len(points)


def test_what_is_refused(small, wall):
    points, labels = wall
    with pytest.raises(tessera.InputError, match="classes"):
        tessera.Evaluation(small, tessera.ClassTable.semantic_kitti())
    with pytest.raises(tessera.InputError, match="max_range_m"):
        tessera.Evaluation(small, max_range_m=-1.0)
    with pytest.raises(TypeError):
        tessera.Evaluation(None)
    evaluation = tessera.Evaluation(small)
    with pytest.raises(tessera.InputError, match="truth has the shape"):
        evaluation.add(points, labels[1:])
    with pytest.raises(tessera.InputError, match="T_map_sensor"):
        evaluation.add(points, labels, np.zeros((4, 4)))
    with pytest.warns(UserWarning, match="no point has labelled truth"):
        assert evaluation.report()["points"] == 0 == evaluation.mean_iou

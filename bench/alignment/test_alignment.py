# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""What the bench of alignments draws, computes and sums up, and that the page has a place for each table."""
import math
import pathlib
import sys
import tempfile
import unittest

HERE = pathlib.Path(__file__).resolve().parent
sys.path += [str(HERE.parent), str(HERE.parent / "experiments")]

import judging  # noqa: E402  these need the paths above
import negatives  # noqa: E402
import tables  # noqa: E402
import transforms  # noqa: E402
from datasets import IDENTITY, inverse, product  # noqa: E402
from write_docs import PART, fill  # noqa: E402

PAGE = HERE.parents[1] / "docs" / "measured" / "alignment.md"


def moved_by(x, y, z):
    return [[1.0, 0.0, 0.0, x], [0.0, 1.0, 0.0, y], [0.0, 0.0, 1.0, z], [0.0, 0.0, 0.0, 1.0]]


class Transforms(unittest.TestCase):
    def assert_near(self, expected, T):
        for row, other in zip(expected, T):
            for value, measured in zip(row, other):
                self.assertAlmostEqual(value, measured, places=9)

    def test_a_draw_is_of_its_seed_alone(self):
        self.assertEqual(transforms.draw(7), transforms.draw(7))
        self.assertNotEqual(transforms.draw(7), transforms.draw(8))

    def test_draws_are_rigid_and_within_the_reach_and_use_it(self):
        draws = [transforms.draw(seed) for seed in range(1, 401)]
        self.assert_near(IDENTITY, product(draws[0], inverse(draws[0])))
        tilts = [math.degrees(math.acos(min(1.0, T[2][2]))) for T in draws]
        yaws = [math.degrees(math.atan2(T[1][0], T[0][0])) for T in draws]
        self.assertTrue(4.9 < max(tilts) <= transforms.MOST_TILT_DEG, max(tilts))
        self.assertTrue(min(yaws) < -175 and max(yaws) > 175)
        for axis, reach_m in enumerate((transforms.REACH_XY_M, transforms.REACH_XY_M, transforms.REACH_Z_M)):
            along = [T[axis][3] for T in draws]
            self.assertTrue(-reach_m <= min(along) < -0.97 * reach_m and 0.97 * reach_m < max(along) <= reach_m)

    def test_an_error_is_where_the_maps_overlap(self):
        exact = transforms.draw(3)
        about = [12.0, -4.0, 1.0]
        m, deg = transforms.error(exact, exact, about)
        self.assertAlmostEqual(0.0, m)
        self.assertAlmostEqual(0.0, deg)
        m, deg = transforms.error(product(moved_by(0.2, 0.0, 0.1), exact), exact, about)
        self.assertAlmostEqual(math.hypot(0.2, 0.1), m)
        for expected, along in zip((0.2, 0.0, 0.1), transforms.offset(product(moved_by(0.2, 0.0, 0.1), exact), exact, about)):
            self.assertAlmostEqual(expected, along)
        self.assertAlmostEqual(0.0, deg)
        # A turn about that point moves it nowhere; about A's origin it does.
        turned = product(product(moved_by(*about), transforms.turn(2, math.radians(0.5))), inverse(moved_by(*about)))
        m, deg = transforms.error(product(turned, exact), exact, about)
        self.assertAlmostEqual(0.0, m)
        self.assertAlmostEqual(0.5, deg)
        self.assertAlmostEqual(2 * 13.0 * math.sin(math.radians(0.25)), transforms.error(product(turned, exact), exact, [0.0, 1.0, 0.0])[0])

    def test_angles_small_and_large(self):
        for angle_deg in (1e-4, 0.3, 90.0, 179.9):
            self.assertAlmostEqual(angle_deg, transforms.angle_deg(transforms.turn(1, math.radians(angle_deg))))

    def test_false_is_over_either_bound(self):
        self.assertFalse(transforms.is_false(0.3, 1.0))
        self.assertTrue(transforms.is_false(0.31, 0.0))
        self.assertTrue(transforms.is_false(0.0, 1.01))

    def test_poses_are_read_back_as_they_were(self):
        poses = [transforms.draw(seed) for seed in range(5)]
        with tempfile.TemporaryDirectory() as folder:
            self.assertEqual(poses, transforms.read_poses(transforms.write_poses(pathlib.Path(folder) / "poses.txt", poses)))

    def test_poses_of_a_camera_move_as_those_of_the_sensor(self):
        T, Tr, pose = (transforms.draw(seed) for seed in (1, 2, 3))
        of_sensor = product(product(inverse(Tr), pose), Tr)
        self.assert_near(transforms.moved([of_sensor], T)[0],
                         product(product(inverse(Tr), transforms.moved([pose], T, Tr)[0]), Tr))

    def test_calibration(self):
        with tempfile.TemporaryDirectory() as name:
            path = pathlib.Path(name) / "calib.txt"
            self.assertIsNone(transforms.read_calibration(path))
            path.write_text("P0: 1 0 0 0 0 1 0 0 0 0 1 0\nTr: 1 0 0 0.5 0 1 0 2 0 0 1 -1\n")
            self.assertEqual(moved_by(0.5, 2.0, -1.0), transforms.read_calibration(path))


def report(T, accepted=True, support=5000.0):
    return {"transform": [value for row in T for value in row], "covariance_about": [1.0, 2.0, 0.0], "accepted": accepted,
            "reason": None if accepted else "too little", "support": support, "support_second": 0.0, "agreement": {"share": 0.9},
            "sigma_m": 0.01, "sigma_deg": 0.1, "cpu_s": 1.0}


class Sums(unittest.TestCase):
    def test_a_trial_against_poses_and_icp(self):
        exact = transforms.draw(1)
        trial = judging.judged(report(product(moved_by(0.4, 0.0, 0.0), exact)), exact, icp=moved_by(0.35, 0.0, 0.0))
        self.assertAlmostEqual(0.4, trial["m"])
        self.assertAlmostEqual(0.05, trial["icp_m"])
        self.assertTrue(trial["false"])
        self.assertFalse(judging.is_within(trial, (0.1, 0.5)))
        self.assertTrue(judging.is_within(trial, (0.1, 0.5), "icp_"))

    def test_what_is_refused_is_neither_false_nor_within(self):
        trial = judging.judged(report(IDENTITY, accepted=False), IDENTITY)
        self.assertFalse(trial["false"])
        self.assertFalse(judging.is_within(trial, (0.1, 0.5)))

    def test_shares(self):
        self.assertEqual([50, 95, 100], judging.spread(range(100, 0, -1)))
        self.assertEqual([3, 3, 3], judging.spread([3]))

    def test_means_along_axes(self):
        self.assertEqual([(2.0, 1.0), (0.0, 0.0), (-1.0, 0.0)], judging.along_axes([[1.0, 0.0, -1.0], [3.0, 0.0, -1.0]]))

    def test_reasons_by_their_number(self):
        refused = [{"accepted": False, "reason": reason, "support": support} for reason, support in (("a", 3), ("b", 1), ("b", 9), ("b", -2))]
        self.assertEqual([("b", (3, 9)), ("a", (1, 3))], list(judging.reasons([*refused, {"accepted": True}]).items()))

    def test_upper_limits(self):
        self.assertAlmostEqual(2.9957 / 1000, judging.upper_limit(0, 1000), places=6)
        self.assertAlmostEqual(4.7439 / 1000, judging.upper_limit(1, 1000), places=6)
        self.assertEqual(1.0, judging.upper_limit(0, 1))


class Negatives(unittest.TestCase):
    def test_all_pairs_once_in_an_order_of_their_own(self):
        streets, recorded = ["s1", "s2", "s3"], ["r1", "r2"]
        pairs = negatives.pairs_of(streets, recorded)
        self.assertEqual(3 * 2 + 2 * 1 + 2 * 3 * 2, len({pair[1:] for pair in pairs}))
        self.assertEqual(len(pairs), len(set(pairs)))
        self.assertTrue(all(a != b for _, a, b in pairs))
        self.assertEqual(pairs, negatives.pairs_of(streets, recorded))


class Page(unittest.TestCase):
    def test_the_page_has_a_place_for_each_table(self):
        self.assertEqual(list(tables.TABLES), [match[1] for match in PART.findall(PAGE.read_text())])

    def test_tables(self):
        place = transforms.draw(1)
        trials = [{"seed": seed, **judging.judged(report(place, support=4000.0 + seed), place, IDENTITY)} for seed in (1, 2)]
        trials.append({"seed": 3, **judging.judged(report(place, accepted=False), place, IDENTITY)})
        pair = {"kind": negatives.KINDS[0], "a": "street_1", "b": "street_2", **judging.outcome(report(place, accepted=False, support=70.0))}
        found = {"version": "tessera 1", "circumstances": {"cpu": "c", "cores": 2, "memory_gb": 4, "system": "s", "commit": "c", "date": "d"},
                 "rows": {"balm_room": {"title": "halves", "truth": "poses", "bounds": (0.05, 0.3), "overlap": [0.5], "trials": trials,
                                        "poses_against_icp": (0.07, 0.2)}},
                 "negatives": {"of": 1, "order_seed": 1, "pairs": [pair]}}
        text, used = fill(PAGE.read_text(), found, tables.TABLES)
        self.assertEqual(list(tables.TABLES), used)
        for row in ("| halves | 3 | 1-3 | 0.50 | 66.7 % | 0.05 m, 0.3 degrees | 66.7 % | 66.7 % | 0 |", "| halves | refused: too little | 1 | at most 5,000 |",
                    "| least support of a true pair that was accepted | 4,001 | 90.0 % |", "| street and street | 1 | 0 | 100.00 % |"):
            self.assertIn(row, text)


if __name__ == "__main__":
    unittest.main()

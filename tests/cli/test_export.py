# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""export --format pcd, npy, csv, bt and ot: what other programs read is what the map says; --prior-map reads it back."""
import json
import shutil
import struct
import subprocess
import unittest

import kitti_folder as kitti
from command_case import MEMORY, CommandCase

try:
    import numpy
except ImportError:
    numpy = None

# x y z, red green blue label state, probability variance evidence, then the counts of 19 classes and two components.
NPY_ROW = struct.Struct("<3f5B3f21f")


class ExportCase(CommandCase):
    def setUp(self):
        super().setUp()
        data = kitti.write_dataset(self.folder / "data", [kitti.corner_scan(1)])
        _, self.made = self.map_dataset(data, self.folder / "map.tsm")

    def export(self, form, *options, name="map", source="map.tsm"):
        out = self.folder / f"{name}.{form}"
        result = self.done("export", "--map", source, "--format", form, "--out", out, "--report", "report.json", *options)
        return result, out.read_bytes(), json.loads((self.folder / "report.json").read_text())

    def rows(self, *options):
        _, text, report = self.export("csv", *options)
        lines = text.decode().splitlines()
        columns = lines[0].split(",")
        rows = [dict(zip(columns, line.split(","), strict=True)) for line in lines[1:]]
        self.assertEqual(report["voxels"], len(rows))
        return rows

    def npy_rows(self, *options):
        _, content, report = self.export("npy", *options)
        self.assertEqual(b"\x93NUMPY\x01\x00", content[:8])
        start = 10 + struct.unpack("<H", content[8:10])[0]
        self.assertEqual(0, start % 64)
        self.assertIn(f"'shape': ({report['voxels']},)".encode(), content[:start])
        return list(NPY_ROW.iter_unpack(content[start:]))


class Tables(ExportCase):
    def test_csv_is_what_query_says_of_the_same_points(self):
        _, content, _ = self.export("csv", "--voxels", "observed")
        lines = content.decode().splitlines()
        (self.folder / "points.csv").write_text("x,y,z\n" + "".join(
            ",".join(line.split(",")[:3]) + "\n" for line in lines[1:]))
        self.done("query", "--map", "map.tsm", "--points", "points.csv", "--out", "states.csv")
        self.assertEqual((self.folder / "states.csv").read_bytes(), content)
        states = {state: sum(f",{state}," in line for line in lines[1:]) for state in ("occupied", "free", "unknown")}
        self.assertEqual(0, states["unknown"])
        self.assertEqual(len(self.rows()), states["occupied"])
        self.assertGreater(states["free"], 0)

    def test_npy_has_the_same_rows_as_csv(self):
        rows, arrays = self.rows(), self.npy_rows()
        self.assertEqual(len(rows), len(arrays))
        for row, array in zip(rows, arrays, strict=True):
            for column, value in zip(("x", "y", "z"), array[:3], strict=True):
                self.assertAlmostEqual(float(row[column]), value, 5)
            self.assertEqual((int(row["label"]), 2), array[6:8])
            for column, value in zip(("probability", "variance", "evidence"), array[8:11], strict=True):
                self.assertAlmostEqual(float(row[column]), value, 5)
            for component, value in enumerate(array[11:]):
                self.assertAlmostEqual(float(row[f"sigma_{component}"]), value, 4)

    @unittest.skipIf(numpy is None, "no numpy here")
    def test_numpy_loads_it_without_pickle(self):
        self.export("npy", "--voxels", "observed")
        array = numpy.load(self.folder / "map.npy", allow_pickle=False)
        self.assertEqual((21,), array["sigma"].shape[1:])
        numpy.testing.assert_allclose(array["sigma"].sum(axis=1), array["evidence"], rtol=1e-5)

    def test_pcd_is_binary_with_the_fields_of_pcl_and_can_be_mapped_again(self):
        _, content, report = self.export("pcd")
        head, _, body = content.partition(b"DATA binary\n")
        self.assertIn(b"\nFIELDS x y z rgb label probability variance evidence state\n", head)
        self.assertIn(b"\nTYPE F F F F U F F F U\n", head)
        self.assertIn(b"# label 9 road\n", head)
        rows = list(struct.Struct("<3fII3fI").iter_unpack(body))
        self.assertEqual(report["voxels"], len(rows))
        self.assertIn((0xFF00FF, kitti.ROAD_LABEL), {(row[3], row[4]) for row in rows})
        clouds = self.folder / "clouds"
        clouds.mkdir()
        (clouds / "0.pcd").write_bytes(content)
        (clouds / "classes.toml").write_text("".join(
            f'[[class]]\nid = {i}\nname = "c{i}"\ncolor = "#000000"\nraw = [{i}]\n' for i in range(1, 20)))
        (self.folder / "poses.txt").write_text("1 0 0 0 0 1 0 0 0 0 1 0\n")
        self.done("map", "--pcd", clouds, "--poses", "poses.txt", "--out", "again.tsm", "--min-range", "0",
                  "--max-range", "0", "--free-space", "off", "--inference", "counting", *MEMORY)
        _, again, _ = self.export("csv", name="again", source="again.tsm")
        place = [tuple(row[axis] for axis in "xyz") for row in self.rows()]
        self.assertEqual(place, [tuple(line.split(",")[:3]) for line in again.decode().splitlines()[1:]])

    def test_limits_and_layers_hold_for_tables(self):
        everything = self.rows()
        limit = sorted(float(row["evidence"]) for row in everything)[len(everything) // 2]
        kept = self.rows("--min-evidence", limit)
        self.assertTrue(0 < len(kept) < len(everything))
        self.assertTrue(all(float(row["evidence"]) >= limit - 1e-6 for row in kept))
        colors = {row[3:6] for row in self.npy_rows("--show", "variance")}
        self.assertNotEqual(colors, {row[3:6] for row in self.npy_rows()})
        result, content, report = self.export("csv", "--min-evidence", "1e6")
        self.assert_warned(result, "no occupied voxel passes")
        self.assertEqual((0, 1), (report["voxels"], content.count(b"\n")))

    def test_robots_of_a_global_map(self):
        data = kitti.write_dataset(self.folder / "other", [kitti.corner_scan(2)])
        self.map_dataset(data, self.folder / "b.tsm", "--robot", "1")
        self.done("fuse", "map.tsm", "b.tsm", "--out", "g.tsm")
        _, content, report = self.export("csv", "--show", "contributors", "--of", "map.tsm", "b.tsm", source="g.tsm")
        lines = content.decode().splitlines()
        self.assertTrue(lines[0].endswith(",sigma_20,robots"))
        self.assertEqual(report["shared_voxels"], sum(line.endswith(",2") for line in lines[1:]))


class Octrees(ExportCase):
    def test_a_tree_that_is_read_back_has_the_map_s_occupancy(self):
        expected = {tuple(row[axis] for axis in "xyz"): row["state"] for row in self.rows("--voxels", "observed")}
        for form in ("bt", "ot"):
            with self.subTest(form):
                result, _, report = self.export(form)
                self.assertEqual([], [line for line in result.stderr.splitlines() if not line.startswith("exporting: ")])
                self.assertEqual(len(expected), report["voxels"])
                self.assertEqual(sum(state == "free" for state in expected.values()), report["free_voxels"])
                empty = kitti.write_dataset(self.folder / "empty", [kitti.Scan([], [])])
                _, mapped = self.map_dataset(empty, self.folder / "prior.tsm", "--prior-map", f"map.{form}")
                self.assertEqual({"occupied_voxels": report["occupied_voxels"], "free_voxels": report["free_voxels"],
                                  "refused_voxels": 0, "free_passes": 3, "resolution": 0.1}, mapped["prior_map"])
                _, content, _ = self.export("csv", "--voxels", "observed", name="prior", source="prior.tsm")
                lines = [line.split(",") for line in content.decode().splitlines()[1:]]
                self.assertEqual(expected, {tuple(line[:3]): line[3] for line in lines})
                self.assertEqual({"0"}, {line[4] for line in lines})

    def test_a_global_map_has_its_own_occupancy(self):
        data = kitti.write_dataset(self.folder / "other", [kitti.corner_scan(2)])
        self.map_dataset(data, self.folder / "b.tsm", "--robot", "1")
        self.done("fuse", "map.tsm", "b.tsm", "--out", "g.tsm")
        _, content, _ = self.export("csv", "--voxels", "observed", source="g.tsm")
        _, _, report = self.export("bt", source="g.tsm")
        self.assertEqual([content.count(b",occupied,"), content.count(b",free,")],
                         [report["occupied_voxels"], report["free_voxels"]])

    @unittest.skipUnless(shutil.which("convert_octree"), "no octomap-tools here")
    def test_octomap_s_own_tool_opens_them(self):
        for form in ("bt", "ot"):
            self.export(form)
            made = subprocess.run(["convert_octree", f"map.{form}", "tool.bt"], cwd=self.folder, capture_output=True,
                                  text=True, check=True)
            self.assertNotIn("ERROR", made.stdout + made.stderr)
            # Its own .bt of our tree is ours, the header aside.
            ours, _, _ = self.export("bt", name="ours")
            tree = [(self.folder / name).read_bytes().partition(b"\ndata\n")[2] for name in ("tool.bt", "ours.bt")]
            self.assertEqual(*tree)

    def test_what_does_not_go_together(self):
        refused = ("export", "--map", "map.tsm", "--out", "x.bt", "--format")
        self.refused(*refused, "bt", "--show", "variance", saying=("--show", "bt has none"))
        self.refused(*refused, "ot", "--min-probability", "0.5", saying=("--min-probability",))
        self.refused(*refused, "bt", "--voxels", "observed", saying=("--voxels",))
        self.refused(*refused, "csv", "--show", "variance", saying=("csv has none",))
        for option, value, of in (("--view", "top", "png"), ("--width", "900", "png"), ("--title", "a", "png"), ("--ply-form", "cubes", "ply")):
            self.refused(*refused, "csv", option, value, saying=(option, f"choose --format {of}"))
        self.refused(*refused, "csv", "--voxels", "all", saying=("occupied or observed",))
        self.refused(*refused, "vrml", saying=("png, ply, pcd, npy, csv, bt or ot",))
        self.assertFalse((self.folder / "x.bt").exists())

    def test_prior_maps_that_are_refused(self):
        _, good, _ = self.export("bt")
        data, prior = self.folder / "data", self.folder / "prior.bt"
        for content, says in ((good[:-1], "ends too early"), (good + b"x", "after its tree"), (b"", "does not begin"),
                              (good.replace(b"size ", b"size 9"), "nodes, but it has"),
                              (good.replace(b"res 0.1", b"res 0.3"), "times as wide"),
                              (b"# Octomap OcTree binary file\nid OcTree\nsize 2\nres 0.1\ndata\n\x01\x00", "cover more than")):
            prior.write_bytes(content)
            self.map_refused(data, "--prior-map", prior, *MEMORY, saying=("prior.bt", says))
        prior.write_bytes(good)
        given = ("--prior-map", prior)
        self.map_refused(data, *given, "--prior-map-weight", "0", saying=("--prior-map-weight",))
        self.map_refused(data, "--prior-map-weight", "2", saying=("--prior-map",))
        self.map_refused(data, *given, "--continue", "map.tsm", saying=("new map",))
        self.map_refused(data, *given, "--resolution", "0.2", saying=("times as wide",))
        self.refused("map", "--dataset", data, "--out", prior, *given, saying=("--prior-map",))
        self.assertEqual(good, prior.read_bytes())

    def test_a_prior_map_gives_way_to_what_is_seen(self):
        wall = kitti.write_dataset(self.folder / "wall", [kitti.Scan([(10.05, 0.05, 0.05)] * 40, [kitti.ROAD] * 40)])
        self.map_dataset(wall, self.folder / "wall.tsm")
        self.export("bt", source="wall.tsm", name="wall")
        seen = kitti.write_dataset(self.folder / "seen", [kitti.Scan([(20.05, 0.05, 0.05)], [kitti.CAR])] * 8)
        # Carved by the image, a voxel through which scans see again and again is free whatever it weighed.
        for carving, weight, state in (("rays", "0.5", "free"), ("rays", "50", "occupied"), ("image", "50", "free")):
            self.map_dataset(seen, self.folder / "seen.tsm", "--prior-map", "wall.bt", "--prior-map-weight", weight, "--carving", carving)
            _, rows = self.query_rows("seen.tsm", "x,y,z\n10.05,0.05,0.05\n")
            self.assertEqual(state, rows[0]["state"], (carving, weight))


if __name__ == "__main__":
    unittest.main()

# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""The page lights voxels and colours heights as the pictures do: the same constants."""
import pathlib
import re
import unittest

PLATFORM = pathlib.Path(__file__).resolve().parents[2] / "platform"


class Light(unittest.TestCase):
    def test_tones_are_those_of_the_pictures(self):
        code = (PLATFORM / "pictures/oblique_view.cpp").read_text()
        page = dict(re.findall(r"const (k\w+) = ([0-9.]+);", (PLATFORM / "view/page/light.js").read_text()))
        self.assertEqual({"kTopTone", "kBottomTone", "kSideTone", "kSideContrast", "kLightFromForward"}, set(page))
        for name, value in page.items():
            with self.subTest(name):
                of_pictures = re.search(rf"constexpr float {name}(?:_rad)? = ([0-9.]+)F;", code)
                self.assertIsNotNone(of_pictures)
                self.assertEqual(float(of_pictures.group(1)), float(value))

    def test_heights_have_the_colours_of_the_pictures(self):
        def numbers(text):
            return [int(n) for n in re.findall(r"\b\d+\b", text)]

        scale = re.search(r"kScale = \[(.*)\];", (PLATFORM / "view/page/layers.js").read_text()).group(1)
        colors = re.findall(r"Color\{(.*?)\}", (PLATFORM / "cli/height_layer.hpp").read_text())
        self.assertEqual(8, len(colors))
        self.assertEqual(numbers(scale), numbers(" ".join(colors)))


if __name__ == "__main__":
    unittest.main()

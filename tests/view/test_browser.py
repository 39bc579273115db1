# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""The page in headless Chromium: what it shows, against what query says; by mouse and by keyboard, wide and narrow, light and
dark."""
import collections
import json
import unittest

from browser import LAPTOP, PHONE, Browser
from PIL import ImageChops
from selenium.webdriver.common.keys import Keys
from serving import Server, ViewCase, read_all

LAYERS = ("class", "probability", "variance", "contributor", "disagreement", "age", "height", "moved")


def colors(picture):
    return collections.Counter(picture.getdata())


def drawn_share(picture):
    """Of the picture, what is not its background."""
    counts = colors(picture)
    return 1 - counts.most_common(1)[0][1] / sum(counts.values())


def changed_share(one, other):
    """Of the picture, what differs by more than a shade."""
    different = ImageChops.difference(one, other).convert("L").point(lambda v: 255 if v > 12 else 0)
    return different.histogram()[255] / (one.width * one.height)


class Page(ViewCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.browser = Browser()
        cls.addClassCleanup(cls.browser.close)

    def setUp(self):
        self.browser.resize(LAPTOP)
        self.browser.theme(False)
        self.browser.open(self.server.url)

    def tearDown(self):
        self.assertEqual([], self.browser.faults())

    def picked(self):
        """All that the panel says, at one moment."""
        self.browser.until(lambda: self.browser.text("voxel-probability"), "a voxel")
        return self.browser.run("""
            const text = (name) => document.getElementById(`voxel-${name}`).textContent;
            const cells = [...document.querySelectorAll('#voxel tr[data-component]')].map(r => [r.dataset.component, r.querySelector('.sigma').textContent]);
            const names = ['class', 'state', 'probability', 'variance', 'evidence', 'label', 'center', 'place'];
            return { ...Object.fromEntries(names.map(name => [name, text(name)])), cells: Object.fromEntries(cells) };""")

    def assert_as_query(self, shown, name):
        row = self.query(name, shown["center"].split())
        for key in ("state", "probability", "variance", "evidence", "label"):
            self.assertEqual(row[key], shown[key], key)
        expected = {str(i): row[f"sigma_{i}"] for i in range(21) if float(row[f"sigma_{i}"]) > 0}
        self.assertEqual(expected, shown["cells"])

    def test_a_map_is_drawn_with_all_of_its_voxels(self):
        _, blocks = read_all(self.server, 0)
        self.assertEqual(sum(voxel[5] & 2 == 0 for block in blocks.values() for voxel in block["voxels"]), int(self.browser.data("voxels")))
        picture = self.browser.picture("class")
        self.assertGreater(drawn_share(picture), 0.03)
        self.assertGreater(len(colors(picture)), 20)
        self.assertEqual("file", self.browser.text("connection"))

    def test_a_click_shows_the_numbers_of_query(self):
        for number, name in enumerate(self.ARGUMENTS[:2]):
            self.browser.run("const s = document.getElementById('map-select'); s.value = arguments[0]; s.dispatchEvent(new Event('change'))", str(number))
            self.browser.until(lambda: self.browser.data("complete") == "true", "the other map")
            self.browser.settle()
            seen = set()
            picture = self.browser.picture()
            background = colors(picture).most_common(1)[0][0]
            places = [(x, y) for y in range(5, picture.height - 5, 9) for x in range(5, picture.width - 5, 9)
                      if all(picture.getpixel((x + dx, y + dy)) != background for dx in (-1, 0, 1) for dy in (-1, 0, 1))]
            for x, y in places[::max(1, len(places) // 3)][:3]:
                before = self.browser.run("return document.getElementById('voxel-place')?.textContent ?? ''")
                self.browser.click(x, y + 48)
                self.browser.until(lambda: self.browser.run("return document.getElementById('voxel-place')?.textContent ?? ''") != before, f"a voxel at {x}, {y}")
                shown = self.picked()
                self.assert_as_query(shown, name)
                seen.add(shown["place"])
            self.assertGreaterEqual(len(seen), 2)

    def test_each_layer_is_another_picture_with_a_legend(self):
        pictures, legends = {}, set()
        for layer in LAYERS:
            self.browser.run("document.getElementById(arguments[0]).click()", f"layer-{layer}")
            self.browser.settle()
            pictures[layer] = self.browser.picture(layer)
            legends.add(self.browser.text("legend"))
            self.assertEqual("", self.browser.text("layer-note"))
        self.assertEqual(len(LAYERS), len(legends))
        for i, one in enumerate(LAYERS):
            for other in LAYERS[i + 1:]:
                self.assertGreater(changed_share(pictures[one], pictures[other]), 0.01, (one, other))

    def test_a_layer_that_says_nothing_of_a_map_says_why(self):
        self.browser.open(self.server.url + "#map=1&layer=disagreement")
        self.assertIn("local map", self.browser.text("layer-note"))
        self.assertEqual("", self.browser.text("legend"))

    def test_all_of_it_by_the_keyboard_alone(self):
        self.browser.tab_to("map-select")
        self.browser.press(Keys.ARROW_DOWN)
        self.browser.until(lambda: self.browser.run("return location.hash").startswith("#map=1"), "the next map")
        self.browser.settle()
        self.browser.tab_to("canvas")
        outline = self.browser.run("return getComputedStyle(document.activeElement).outlineStyle")
        self.assertEqual("solid", outline, "the focus is seen")
        before = self.browser.picture()
        self.browser.press(Keys.ARROW_LEFT, Keys.ARROW_LEFT, Keys.ARROW_UP)
        self.browser.settle()
        turned = self.browser.picture()
        self.assertGreater(changed_share(before, turned), 0.005)
        self.browser.press(*("+" * 6))
        self.browser.settle()
        self.assertGreater(drawn_share(self.browser.picture()), 1.3 * drawn_share(turned))
        self.browser.press("f", "t")
        self.browser.settle()
        self.browser.press(Keys.ENTER)
        for _ in range(30):  # Where the centre lies between voxels, a little beside it.
            if self.browser.run("return document.getElementById('voxel').hidden") is False:
                break
            self.browser.press(Keys.SHIFT + Keys.ARROW_LEFT, Keys.NULL, Keys.ENTER)
        self.assert_as_query(self.picked(), "robot_0.tsm")
        self.browser.press("3")
        self.browser.until(lambda: "Variance" in self.browser.text("legend"), "the third layer")
        self.browser.press(Keys.ESCAPE)
        self.assertTrue(self.browser.run("return document.getElementById('voxel').hidden"))
        for name in ("zoom-in", "zoom-out", "fit", "top"):
            self.browser.tab_to(name)
        self.browser.tab_to("layer-variance")
        self.browser.press(Keys.ARROW_RIGHT)
        self.browser.until(lambda: "only robot" in self.browser.text("legend") or "robot 0" in self.browser.text("legend"), "the next layer")

    def test_everything_that_is_worked_with_has_a_name(self):
        unnamed = self.browser.run("""return [...document.querySelectorAll('button, select, input, canvas, summary, [role]')]
            .filter(e => !(e.getAttribute('aria-label') || e.getAttribute('aria-labelledby') || e.labels?.length || e.textContent.trim()))
            .map(e => e.outerHTML).filter(e => !e.includes('hidden'))""")
        self.assertEqual([], [e for e in unnamed if 'role="status"' not in e and 'role="alert"' not in e and 'id="histogram"' not in e])

    def test_a_phone_shows_all_of_it_without_scrolling_sideways(self):
        self.browser.resize(PHONE)
        self.browser.open(self.server.url)
        self.assertGreater(drawn_share(self.browser.picture("phone")), 0.02)
        wide = self.browser.run("""return [document.documentElement.scrollWidth, document.getElementById('side').scrollWidth,
            ...[...document.querySelectorAll('body *')].filter(e => e.getClientRects().length && !e.classList.contains('skip')).map(e => e.getBoundingClientRect().right)]""")
        self.assertLessEqual(max(wide), PHONE[0] + 0.5)
        small = self.browser.run("""return [...document.querySelectorAll('button, #layers label')].map(e => e.getBoundingClientRect())
            .filter(b => b.height < 40 || b.width < 40).length""")
        self.assertEqual(0, small, "a finger is wide")

    def test_light_and_dark(self):
        def brightness():
            background = colors(self.browser.picture()).most_common(1)[0][0]
            panel = self.browser.run("return getComputedStyle(document.getElementById('side')).backgroundColor")
            return sum(background) / 3, sum(map(int, panel[4:-1].split(","))) / 3
        self.assertGreater(min(brightness()), 200)
        self.browser.theme(True)
        self.browser.until(lambda: max(brightness()) < 60, "the dark")
        self.browser.picture("dark")

    def test_no_request_leaves_for_elsewhere(self):
        self.browser.driver.get_log("performance")
        self.browser.open(self.server.url)
        sent = []
        for entry in self.browser.driver.get_log("performance"):
            message = json.loads(entry["message"])["message"]
            if message["method"] == "Network.requestWillBeSent":
                sent.append(message["params"]["request"]["url"])
        sent = [url for url in sent if not url.startswith(("about:", "data:"))]
        self.assertGreater(len(sent), 10)
        self.assertEqual([], [url for url in sent if not url.startswith(self.server.url)])

    def test_a_server_that_ends_and_comes_back_is_found(self):
        server = Server(self.folder, "robot_1.tsm")
        self.addCleanup(lambda: server.close())
        self.browser.open(server.url)
        voxels = self.browser.data("voxels")
        server.close()
        self.browser.until(lambda: self.browser.text("connection") == "reconnecting", "that it is lost")
        server = Server(self.folder, "robot_0.tsm", "--listen", f"127.0.0.1:{server.port}")
        self.browser.until(lambda: self.browser.text("connection") == "file", "that it is back")
        self.browser.until(lambda: self.browser.data("voxels") != voxels, "the other map")
        self.assertIn("robot_0", self.browser.text("map-select"))
        self.browser.faults()  # Of the time without a server.

    def test_a_page_that_was_half_lost_often_asks_no_more_often(self):
        # Blocks are lost and the rest is not, so what asks for the rest must end without a failure of its own.
        self.browser.driver.execute_cdp_cmd("Network.enable", {})
        for _ in range(3):
            self.browser.driver.execute_cdp_cmd("Network.setBlockedURLs", {"urls": ["*/blocks*"]})
            self.browser.until(lambda: self.browser.text("connection") == "reconnecting", "that it is lost")
            self.browser.driver.execute_cdp_cmd("Network.setBlockedURLs", {"urls": []})
            self.browser.until(lambda: self.browser.text("connection") == "file", "that it is back")
        self.browser.run("performance.clearResourceTimings()")
        times = """return performance.getEntriesByType('resource').filter(e => e.name.endsWith('/status')).map(e => e.startTime)"""
        self.browser.until(lambda: len(self.browser.run(times)) >= 4, "four questions")
        asked_ms = self.browser.run(times)
        # One question every 3 s; those of two that ask fall between each other.
        self.assertGreater(min(b - a for a, b in zip(asked_ms, asked_ms[1:], strict=False)), 2000, asked_ms)
        self.browser.faults()  # Of what was blocked.


if __name__ == "__main__":
    unittest.main()

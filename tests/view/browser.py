# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Headless Chromium that draws in software, as a laptop or as a phone."""
import io
import os
import pathlib
import time

from PIL import Image
from selenium import webdriver
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.keys import Keys

LIMIT_S = 60
LAPTOP, PHONE = (1366, 768), (390, 844)


class Browser:
    def __init__(self, size=LAPTOP, dark=False):
        options = webdriver.ChromeOptions()
        options.binary_location = "/usr/bin/chromium"
        for word in ("--headless=new", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox", "--disable-dev-shm-usage",
                     "--hide-scrollbars", f"--window-size={size[0]},{size[1]}"):
            options.add_argument(word)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
        self.driver = webdriver.Chrome(options=options, service=Service("/usr/bin/chromedriver"))
        self.resize(size)
        self.theme(dark)
        self.addresses = []

    def resize(self, size):
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {"width": size[0], "height": size[1], "deviceScaleFactor": 1,
                                                                           "mobile": size[0] < 500})

    def theme(self, dark):
        value = "dark" if dark else "light"
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": value}]})

    def open(self, url):
        """Opens the page and waits until all of its map is on the screen."""
        self.driver.get("about:blank")
        self.driver.get(url)
        self.settle()

    def settle(self):
        self.until(lambda: self.data("complete") == "true" and self.data("drawn") == "still" and int(self.data("frames")) > 0, "a whole picture")
        time.sleep(0.3)

    def until(self, holds, what):
        end = time.monotonic() + LIMIT_S
        while time.monotonic() < end:
            if found := holds():
                return found
            time.sleep(0.05)
        raise AssertionError(f"this did not come: {what}")

    def data(self, name):
        return self.driver.execute_script("return document.getElementById('canvas').dataset[arguments[0]]", name)

    def run(self, script, *arguments):
        return self.driver.execute_script(script, *arguments)

    def text(self, name):
        return self.run("return document.getElementById(arguments[0])?.textContent.trim() ?? ''", name)

    def focused(self):
        return self.run("return document.activeElement.id")

    def press(self, *keys):
        for key in keys:
            self.driver.switch_to.active_element.send_keys(key)

    def tab_to(self, name, most=40):
        """By the keyboard alone."""
        for _ in range(most):
            self.press(Keys.TAB)
            if self.focused() == name:
                return
        raise AssertionError(f"{name} is not reached by Tab")

    def click(self, x, y):
        """At a place of the picture, in pixels from its upper left."""
        for kind in ("mousePressed", "mouseReleased"):
            self.driver.execute_cdp_cmd("Input.dispatchMouseEvent", {"type": kind, "x": x, "y": y, "button": "left", "clickCount": 1})

    def picture(self, name=None):
        """The canvas as it is on the screen; name: to keep the whole page by."""
        page = Image.open(io.BytesIO(self.driver.get_screenshot_as_png())).convert("RGB")
        if name and os.environ.get("TESSERA_PICTURES"):
            page.save(pathlib.Path(os.environ["TESSERA_PICTURES"]) / f"view_{name}.png")
        box = self.run("const b = document.getElementById('canvas').getBoundingClientRect(); return [b.left, b.top, b.right, b.bottom]")
        # Without what lies on it.
        return page.crop((round(box[0]), round(box[1]), round(box[2]), round(box[3]) - 70))

    def faults(self):
        return [entry["message"] for entry in self.driver.get_log("browser") if entry["level"] == "SEVERE"]

    def close(self):
        self.driver.quit()

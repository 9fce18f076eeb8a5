#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Reads docs/explore.html in headless Chromium: it holds the port as it is, draws, loses nothing by exact, follows the sliders by
keyboard, prints no errors, asks the network for nothing and keeps nobody out. Usage: explore_in_a_browser.py PAGE PORT AXE"""
import json
import os
import sys

from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys

sys.path.append(os.path.join(os.path.dirname(__file__), "../support"))
from browser import SOFTWARE_GL, axe_clean, check, chromium, failures  # noqa: E402

page, port, axe = sys.argv[1:4]
with open(page, encoding="utf-8") as file, open(port, encoding="utf-8") as source:
    check(source.read() in file.read(), "the page holds ports/facetwise.glsl, to the letter")

browser = chromium(*SOFTWARE_GL)


def value(sampler, name):
    figure = browser.find_elements(By.TAG_NAME, "figure")[["cap", "bounded", "exact"].index(sampler)]
    return figure.find_element(By.CSS_SELECTOR, f"[data-is={name}]").text


def lost(sampler):
    return float(value(sampler, "lost").split()[0])


try:
    browser.get("file://" + os.path.abspath(page))
    check(browser.execute_script("return document.documentElement.dataset.drawn") == "yes", "drawn to its end")
    check(lost("exact") == 0 and 0 < lost("bounded") < lost("cap"),
          f"lost: cap {lost('cap')}, bounded {lost('bounded')}, exact {lost('exact')} %")
    share = float(value("cap", "share").split()[0])
    check(abs(100 - lost("cap") - share) < 2, f"cap keeps what the closed form says: {100 - lost('cap'):.2f} and {share} %")
    colors = browser.execute_script("""return [...document.querySelectorAll('canvas')].map(canvas => {
      const copy = document.createElement('canvas');
      copy.width = canvas.width, copy.height = canvas.height;
      const to = copy.getContext('2d');
      document.getElementById('controls').dispatchEvent(new Event('input'));
      to.drawImage(canvas, 0, 0);
      return new Set(new Uint32Array(to.getImageData(0, 0, copy.width, copy.height).data.buffer)).size; })""")
    check(all(count > 50 for count in colors), f"the three views are pictures: {colors} colors")

    before = lost("cap")
    slider = browser.find_element(By.ID, "theta")
    for _ in range(20):
        slider.send_keys(Keys.ARROW_RIGHT)
    check(lost("cap") != before, f"the angle's slider by keyboard: cap loses {before}, then {lost('cap')} %")
    for key in (Keys.END, Keys.HOME):
        slider.send_keys(key)
        check(lost("exact") == (lost("cap") if key == Keys.END else 0),
              f"at the slider's end exact loses {lost('exact')}, cap {lost('cap')} %")
    for box in ("isotropic", "normals"):
        browser.find_element(By.ID, box).send_keys(Keys.SPACE)
    check(not browser.find_element(By.ID, "ay").is_enabled(), "the same roughness along both axes leaves one slider")
    check(lost("exact") == 0, "exact loses nothing there")

    for scheme in ("light", "dark"):
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia",
                                {"features": [{"name": "prefers-color-scheme", "value": scheme}]})
        axe_clean(browser, axe, scheme)
    messages = [entry["message"] for entry in browser.get_log("browser") if entry["level"] in ("SEVERE", "WARNING")]
    messages = [message for message in messages if "GPU stall due to ReadPixels" not in message]
    check(not messages, f"the console is clean {messages[:3]}")
    asked = [entry["params"]["request"]["url"] for entry in
             (json.loads(entry["message"])["message"] for entry in browser.get_log("performance"))
             if entry["method"] == "Network.requestWillBeSent"]
    check(all(url.startswith("file://") or url.startswith("data:") for url in asked), f"no network: {asked[:3]}")
finally:
    browser.quit()
sys.exit(1 if failures else 0)

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes reports with the command and reads them in headless Chromium: no errors, everything drawn, the slider works by
keyboard, nothing keeps a screen reader out, on a phone and on paper too. Usage: page_in_a_browser.py FACETWISE AXE"""
import base64
import json
import os
import re
import subprocess
import sys
import tempfile

from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import Select

sys.path.append(os.path.join(os.path.dirname(__file__), "../support"))
from browser import axe_clean, check, chromium, failures  # noqa: E402

facetwise, axe = sys.argv[1:3]


def run(*arguments, code=0):
    done = subprocess.run([facetwise, *arguments], capture_output=True, text=True, cwd=folder.name)
    check(done.returncode == code, f"facetwise {' '.join(arguments)}: exit code {done.returncode}\n{done.stderr[-500:]}"
          if done.returncode != code else f"facetwise {' '.join(arguments)}")
    return done


folder = tempfile.TemporaryDirectory()
path = lambda name: os.path.join(folder.name, name)
run("bench", "--quick", "--min-seconds", "0.01", "--no-targets", "--json", path("a.json"))
other = json.load(open(path("a.json")))  # as of another day
for number, result in enumerate(other["results"]):
    result["ns_per_sample"] *= 0.8 + 0.1 * (number % 5)
json.dump(other, open(path("b.json"), "w"))
run("experiment", "--quick", "wasted", "--folder", path("pages"))
run("report", "--bench", path("a.json"), "--folder", path("pages"), "--command", "a <command> & more", "--output",
    path("report.html"))
run("report", "--compare", path("a.json"), path("b.json"), "--output", path("changes.html"))
# Errors say which file, and leave nothing behind.
for arguments, named in (
        (["--bench", path("none.json")], "none.json"),
        (["--compare", path("a.json"), path("pages/wasted.json")], "wasted.json")):
    check(named in run("report", *arguments, "--output", path("no.html"), code=1).stderr, f"the error names {named}")
    check(not os.path.exists(path("no.html")), "nothing was written")

browser = chromium("disable-gpu")


def opened(name):
    browser.get("file://" + path(name))
    check(browser.execute_script("return document.documentElement.dataset.drawn") == "yes", f"{name} is drawn to its end")
    errors = [entry["message"] for entry in browser.get_log("browser")]
    check(not errors, f"{name}: nothing on the console {errors}")


def fits():
    return browser.execute_script("return document.documentElement.scrollWidth <= innerWidth")


try:
    opened("report.html")
    loaded = [re.search(r'"url":"([^"]*)"', entry["message"]).group(1) for entry in browser.get_log("performance")
              if '"Network.requestWillBeSent"' in entry["message"]]
    check(all(url.startswith(("file:", "data:")) for url in loaded), "nothing is loaded from a network")

    with open(path("pages/wasted.json"), encoding="utf-8") as file:
        figures = json.load(file)["figures"]
    plots = [figure for figure in figures if figure["type"] == "plot"]
    section = browser.find_element(By.ID, "experiment-wasted")
    svgs = section.find_elements(By.CSS_SELECTOR, ".plot svg")
    check(len(svgs) == len(plots) > 3, f"{len(plots)} plots are drawn")
    for svg, plot in zip(svgs, plots):
        curves = svg.find_elements(By.CSS_SELECTOR, "path.curve")
        lengths = [browser.execute_script("return arguments[0].getTotalLength()", curve) for curve in curves]
        check(len(lengths) == len(plot["series"]) and min(lengths) > 50, f"{plot['title']}: every curve has a length")
        check(svg.get_attribute("aria-label") == plot["alt"], f"{plot['title']}: described in words")
    numbers = section.find_elements(By.CSS_SELECTOR, "figure details table")
    check(len(numbers) == len(plots), "each plot has its numbers behind it")
    bars = browser.find_elements(By.CSS_SELECTOR, "#throughput rect.bar")
    check(len(bars) > 20 and all(float(bar.get_attribute("width")) > 0 for bar in bars), f"{len(bars)} bars are drawn")
    check(len(browser.find_elements(By.CSS_SELECTOR, "#rejections svg[role=img]")) >= 3, "rejections are drawn")
    check("a <command> & more" in browser.find_element(By.ID, "commands").text, "commands are shown as they were typed")

    # The slider, by keyboard.
    figure = browser.find_element(By.CSS_SELECTOR, "figure.pictures")
    above = figure.find_element(By.CSS_SELECTOR, "img.above")
    slider = figure.find_element(By.CSS_SELECTOR, "input[type=range]")
    clip = lambda: above.value_of_css_property("clip-path")
    check(clip() == "inset(0px 50% 0px 0px)", "the slider begins in the middle: " + clip())
    slider.send_keys(Keys.HOME)
    check(clip() == "inset(0px 100% 0px 0px)", "Home shows all of the right picture: " + clip())
    slider.send_keys(Keys.ARROW_RIGHT * 10)
    check(clip() == "inset(0px 90% 0px 0px)", "an arrow moves it by a hundredth: " + clip())
    chosen = Select(figure.find_element(By.CSS_SELECTOR, "select"))
    chosen.select_by_visible_text("visible")
    check(above.get_attribute("alt").startswith("visible."), "the other picture is described too")
    pictures = [one for one in figures if one["type"] == "pictures"][0]
    widths = browser.execute_script(
        "return [...arguments[0].querySelectorAll('.compare img')].map((image) => image.naturalWidth)", figure)
    check(widths == [pictures["width"]] * 2, f"pictures are there: {widths}")
    axe_clean(browser, axe, "report")

    # On a phone and on paper; in the dark.
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride",
                            {"width": 390, "height": 800, "deviceScaleFactor": 2, "mobile": True})
    opened("report.html")
    check(fits(), "nothing is wider than a phone")
    browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia",
                            {"features": [{"name": "prefers-color-scheme", "value": "dark"}]})
    opened("report.html")
    background = browser.find_element(By.TAG_NAME, "body").value_of_css_property("background-color")
    check(background in ("rgba(18, 22, 27, 1)", "rgb(18, 22, 27)"), "dark where the reader wants it dark: " + background)
    axe_clean(browser, axe, "report in the dark")
    paper = base64.b64decode(browser.execute_cdp_cmd("Page.printToPDF", {})["data"])
    check(paper.startswith(b"%PDF") and len(paper) > 50000, f"prints: {len(paper)} bytes")

    opened("changes.html")
    rows = browser.find_elements(By.CSS_SELECTOR, "#comparison tbody tr")
    check(len(rows) > 50, f"{len(rows)} rows of what changed")
    axe_clean(browser, axe, "changes")
finally:
    browser.quit()
    folder.cleanup()
if failures:
    sys.exit(f"{len(failures)} failed")

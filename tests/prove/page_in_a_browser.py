#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Reads the page of `facetwise prove` in headless Chromium. Usage: page_in_a_browser.py FACETWISE PLUGIN AXE"""
import os
import subprocess
import sys
import tempfile

from selenium.webdriver.common.by import By

sys.path.append(os.path.join(os.path.dirname(__file__), "../support"))
from browser import axe_clean, check, chromium, failures  # noqa: E402

facetwise, plugin, axe = sys.argv[1:4]
with tempfile.TemporaryDirectory() as folder:
    page = os.path.join(folder, "proof.html")
    subprocess.run([facetwise, "prove", plugin, "--theta", "0,60", "--alpha", "0.3", "--page", page], capture_output=True)
    browser = chromium()
    try:
        browser.get("file://" + page)
        check("without G1" in browser.title, f"the title names the BSDF: {browser.title}")
        rows = {row.find_element(By.TAG_NAME, "th").text.split("\n")[0]: row.find_elements(By.TAG_NAME, "td")[0].text
                for row in browser.find_elements(By.CSS_SELECTOR, "tbody tr")}
        check({name for name, text in rows.items() if text == "fails"} == {"density", "albedo"}, f"what fails: {rows}")
        colors = browser.execute_script("""return [...document.querySelectorAll('canvas')].map(canvas => new Set(new Uint32Array(
            canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data.buffer)).size)""")
        check(len(colors) == 6 and all(count > 20 for count in colors), f"six pictures: {colors} colors")
        for scheme in ("light", "dark"):
            browser.execute_cdp_cmd("Emulation.setEmulatedMedia",
                                    {"features": [{"name": "prefers-color-scheme", "value": scheme}]})
            axe_clean(browser, axe, scheme)
        messages = [entry["message"] for entry in browser.get_log("browser") if entry["level"] in ("SEVERE", "WARNING")]
        check(not messages, f"the console is clean {messages[:3]}")
    finally:
        browser.quit()
sys.exit(1 if failures else 0)

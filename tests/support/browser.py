# SPDX-License-Identifier: Apache-2.0
"""Headless Chromium for tests, and their checks."""
import os
import socket

from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service

# Selenium asks for "localhost", which a bare system without /etc/hosts does not know.
resolve = socket.getaddrinfo
socket.getaddrinfo = lambda host, *rest, **named: resolve("127.0.0.1" if host == "localhost" else host, *rest, **named)

failures = []


def check(condition, what):
    print(("ok      " if condition else "FAILED  ") + what)
    if not condition:
        failures.append(what)


def chromium(*arguments):
    """It logs the console and the network."""
    options = Options()
    options.binary_location = "/usr/bin/chromium"
    for argument in ("headless", "no-sandbox", "disable-quic", "no-first-run", "disable-background-networking",
                     "disable-component-update", "disable-sync", "window-size=1100,1400", "remote-debugging-pipe", *arguments):
        options.add_argument("--" + argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    return webdriver.Chrome(service=Service("/usr/bin/chromedriver"), options=options)


# WebGL2 where there is no GPU.
SOFTWARE_GL = ("use-angle=swiftshader", "enable-unsafe-swiftshader")


def axe_clean(browser, axe, what):
    """Nothing in the page keeps a screen reader or a keyboard out, as far as axe-core (a file) knows."""
    if not os.path.exists(axe):
        print("skipped " + what + ": axe-core was not fetched")
        return
    with open(axe, encoding="utf-8") as file:
        browser.execute_script(file.read())
    found = browser.execute_async_script("axe.run().then(arguments[0])")
    for violation in found["violations"]:
        print("   ", violation["id"], violation["help"], [node["html"][:120] for node in violation["nodes"]][:3])
    check(not found["violations"], f"{what}: {len(found['passes'])} rules of axe-core pass, none is broken")

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Links between the pages lead somewhere: files are there, and so are headings. links.py SOURCE"""
import os
import re
import subprocess
import sys

os.chdir(sys.argv[1])
pages = subprocess.run(["git", "ls-files", "*.md"], check=True, capture_output=True, text=True).stdout.split()


def anchors(page):
    """As GitHub makes them of headings."""
    with open(page, encoding="utf-8") as file:
        text = re.sub(r"^```.*?^```$", "", file.read(), flags=re.M | re.S)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in re.findall(r"^#+ (.*)$", text, re.M)}


broken = []
for page in pages:
    with open(page, encoding="utf-8") as file:
        text = re.sub(r"^```.*?^```$|`[^`\n]*`", "", file.read(), flags=re.M | re.S)
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if re.match(r"\w+:", target):
            continue
        path, _, heading = target.partition("#")
        there = os.path.normpath(os.path.join(os.path.dirname(page), path)) if path else page
        if not os.path.exists(there) or (heading and there.endswith(".md") and heading not in anchors(there)):
            broken.append(f"{page}: {target}")
print("\n".join(broken) or f"{len(pages)} pages, no broken link")
sys.exit(1 if broken else 0)

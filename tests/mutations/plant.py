#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Plants the mistakes of mistakes.py one at a time in a copy of the tracked files, builds the test programs that should notice, and
says which test does. The golden bits do not count: whoever writes them anew would write the mistake down. Ends with 1 if a mistake
stays unnoticed. One to two minutes each on two cores."""
import argparse
import json
import os
import re
import subprocess
import sys
import time

from mistakes import MISTAKES

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "../.."))
# Golden values; what needs several targets, of which the copy has one; what takes long and notices little that others do not.
NOT_COUNTED = "-Golden.*:Targets.*:*Threads.*:CacheLines.*:*Printed*:RandomWalk.*:*PowerTest.*:*.IsThatOfTheModel*"


def run(*command, **more):
    return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace", **more)


def copy_sources(folder):
    os.makedirs(folder, exist_ok=True)
    tracked = subprocess.run(["git", "-C", ROOT, "ls-files", "-z"], check=True, stdout=subprocess.PIPE).stdout
    packed = subprocess.run(["tar", "-C", ROOT, "-c", "--null", "-T", "-"], input=tracked, check=True, stdout=subprocess.PIPE).stdout
    subprocess.run(["tar", "-C", folder, "-x"], input=packed, check=True)
    # One target, quickly compiled (with the flags below).
    path = os.path.join(folder, "engine/CMakeLists.txt")
    with open(path, encoding="utf-8") as file:
        text = file.read()
    with open(path, "w", encoding="utf-8") as file:
        file.write(text.replace("HWY_DISABLED_TARGETS=(", "HWY_DISABLED_TARGETS=(HWY_AVX3|"))


def build(folder, programs):
    return run("cmake", "--build", os.path.join(folder, "build"), "--target", *programs)


def first_failure(folder, program):
    """The first test that fails; None if all pass."""
    done = run(os.path.join(folder, "build/bin", program), "--gtest_filter=" + NOT_COUNTED, "--gtest_fail_fast",
               "--gtest_brief=1", cwd=os.path.join(folder, "build"))
    failed = re.search(r"\[  FAILED  \] ([^\s,(]+)", done.stdout)
    if failed:
        return failed.group(1)
    return None if done.returncode == 0 else f"ended with {done.returncode}"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--folder", default="/tmp/facetwise-mutations", help="where the copy is built (default: %(default)s)")
    parser.add_argument("--only", metavar="TEXT", default="", help="those whose description has this text")
    parser.add_argument("--from", dest="first", type=int, default=1, metavar="N", help="leave out those before the Nth")
    parser.add_argument("--json", metavar="FILE", help="write what was found here, after each mistake")
    parser.add_argument("--unplanted", action="store_true", help="first show that the tests pass without a mistake")
    arguments = parser.parse_args()

    copy_sources(arguments.folder)
    chosen = [mistake for mistake in MISTAKES[arguments.first - 1:] if arguments.only in mistake[0]]
    programs = sorted({program for mistake in chosen for program in mistake[4]})
    print(f"{len(chosen)} mistakes; building {', '.join(programs)} in {arguments.folder}", flush=True)
    configured = run("cmake", "-S", arguments.folder, "-B", os.path.join(arguments.folder, "build"), "-G", "Ninja",
                     "-DCMAKE_BUILD_TYPE=Release", "-DCMAKE_CXX_FLAGS_RELEASE=-O1 -DNDEBUG -march=haswell -D_GLIBCXX_ASSERTIONS",
                     "-DCMAKE_CXX_COMPILER_LAUNCHER=ccache")
    built = build(arguments.folder, programs)
    if configured.returncode or built.returncode:
        sys.exit(configured.stdout[-3000:] + built.stdout[-3000:])
    if arguments.unplanted:
        for program in programs:
            failure = first_failure(arguments.folder, program)
            if failure:
                sys.exit(f"{program} fails without a mistake: {failure}")
        print("without a mistake all of them pass", flush=True)

    found = []
    for number, (what, file, old, new, programs) in enumerate(chosen, arguments.first):
        path = os.path.join(arguments.folder, file)
        with open(path, encoding="utf-8") as source:
            right = source.read()
        if right.count(old) != 1:
            sys.exit(f"{what}: what {file} should hold once is there {right.count(old)} times")
        began = time.time()
        try:
            with open(path, "w", encoding="utf-8") as source:
                source.write(right.replace(old, new))
            built = build(arguments.folder, programs)
            if built.returncode:
                sys.exit(f"{what}: does not compile\n{built.stdout[-3000:]}")
            noticed = None
            for program in programs:
                noticed = noticed or first_failure(arguments.folder, program)
        finally:
            with open(path, "w", encoding="utf-8") as source:
                source.write(right)
        found.append({"mistake": what, "file": file, "noticed_by": noticed, "seconds": round(time.time() - began)})
        print(f"{number:3} {'noticed' if noticed else 'UNNOTICED'}  {what}: {noticed or file}  ({found[-1]['seconds']} s)",
              flush=True)
        if arguments.json:
            with open(arguments.json, "w", encoding="utf-8") as out:
                json.dump(found, out, indent=1)
    unnoticed = [entry for entry in found if not entry["noticed_by"]]
    print(f"{len(found) - len(unnoticed)} of {len(found)} noticed")
    return 1 if unnoticed else 0


if __name__ == "__main__":
    sys.exit(main())

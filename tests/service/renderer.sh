#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The example renderer gives one picture, whatever its threads, here and on a server in another process: renderer.sh RENDERER ADDRESS
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"$1" "$folder/one.ppm" --samples 4 --threads 1
"$1" "$folder/three.ppm" --samples 4 --threads 3
"$1" "$folder/remote.ppm" --samples 4 --threads 3 "$2"
cmp "$folder/one.ppm" "$folder/three.ppm"
cmp "$folder/one.ppm" "$folder/remote.ppm"
# A picture: many colours, and none of them the whole of it.
colours=$(tail -c +16 "$folder/one.ppm" | od -An -v -t x1 -w3 | sort | uniq | wc -l)
[ "$colours" -gt 5000 ] || { echo "only $colours colours" >&2; exit 1; }
if "$1" "$folder/none.ppm" "unix:$folder/nowhere" 2> "$folder/errors"; then exit 1; fi
grep -q "server unix:$folder/nowhere: no answer" "$folder/errors"

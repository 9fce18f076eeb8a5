#!/usr/bin/env bash
# Installs the build into a fresh folder, builds a program outside against it, and runs it. run.sh BUILD SOURCE
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cmake --install "$1" --prefix "$folder/prefix" > "$folder/log"
cmake -G Ninja -S "$2" -B "$folder/build" -DCMAKE_BUILD_TYPE=Release -DCMAKE_PREFIX_PATH="$folder/prefix" >> "$folder/log"
cmake --build "$folder/build" >> "$folder/log" || { cat "$folder/log"; exit 1; }
"$folder/build/consumer"

#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Runs a program against a server of its own, whose address is its last argument: remote.sh SERVER PROGRAM [ARGUMENT...]
set -euo pipefail
folder=$(mktemp -d)
"$1" --listen "unix:$folder/socket" > "$folder/log" &
server=$!
trap 'kill $server; wait $server || true; rm -rf "$folder"' EXIT
until grep -q ready "$folder/log"; do kill -0 $server; sleep 0.05; done
"${@:2}" "unix:$folder/socket"

#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs the build into a fresh folder, and uses it from outside: programs in C++ and C, the command, its manual, Python.
# run.sh BUILD SOURCE
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
prefix=$folder/prefix
cmake --install "$1" --prefix "$prefix" > "$folder/log"
cmake -G Ninja -S "$2" -B "$folder/build" -DCMAKE_BUILD_TYPE=Release -DCMAKE_PREFIX_PATH="$prefix" >> "$folder/log"
cmake --build "$folder/build" >> "$folder/log" || { cat "$folder/log"; exit 1; }
"$folder/build/consumer"
"$folder/build/both_ends" "$folder/socket"

libraries=$(dirname "$(find "$prefix" -name libfacetwise.so)")
export PKG_CONFIG_PATH=$libraries/pkgconfig LD_LIBRARY_PATH=$libraries
configured() { pkg-config --define-variable=prefix="$prefix" "$@"; }
cc "$2/../../examples/sample.c" -o "$folder/sample" $(configured --cflags --libs facetwise) -lm
"$folder/sample"
g++ -std=c++20 -c "$2/consumer.cc" -o "$folder/consumer.o" $(configured --cflags facetwise-engine)
configured --libs facetwise-engine | grep -q -- -lfacetwise_engine

"$prefix/bin/facetwise" info
man --warnings -l "$prefix/share/man/man1/facetwise.1" 2> "$folder/warnings" | grep -q -- --shared-memory-mib
[ ! -s "$folder/warnings" ] || { cat "$folder/warnings"; exit 1; }
completes() {
  bash -c '. "$0"; COMP_WORDS=(facetwise "${@:2}"); COMP_CWORD=$(($# - 1)); _facetwise; [ "${COMPREPLY[*]}" = "$1" ]' \
    "$prefix/share/bash-completion/completions/facetwise" "$@"
}
completes "serve" ser
completes "exact" sample --sampler e
completes "--metrics" serve --met
PYTHONPATH=$prefix/lib/python3/dist-packages FACETWISE_LIBRARY=$libraries/libfacetwise.so.0 \
  /usr/bin/python3 -c 'import facetwise; print(facetwise.local(), facetwise.version())'

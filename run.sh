#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds facetwise, checks a server against this machine on real input, and measures. See --help.
set -euo pipefail
cd "$(dirname "$0")"

usage() {
  cat <<'EOF'
Usage: ./run.sh [--help]

On a Debian 12 machine, from nothing to a measured result:
  1. installs the packages that are missing (cmake/packages.txt; asks sudo if not root);
  2. builds the release preset into build/release;
  3. starts `facetwise serve` in its own process, on a Unix socket;
  4. sends it batches of 1,048,576 lanes of every model, traced with Embree at a mesh, recomputes every answer here and
     compares every byte (`facetwise verify`);
  5. tries the properties that a BSDF should have on its answers (`facetwise prove`);
  6. runs a short benchmark, scalar, SIMD, threads and remote (`facetwise bench`);
  7. runs the texts' experiments, small (`facetwise experiment --quick`);
  8. prints a summary and makes a page of it all.

Writes  out/report.html  the page, for a browser
        out/report.json  the benchmark's results
        out/verify.json  the comparison, batch by batch
        out/proof.html   what of a BSDF was tried, with pictures
        out/experiments  the experiments, a page each as JSON
        out/*.log        what each step printed
Exit code: 0 if every byte is equal and every step worked.
EOF
}

case "${1:-}" in
  '') ;;
  -h | --help) usage; exit 0 ;;
  *) echo "run.sh: unknown argument \"$1\"" >&2; usage >&2; exit 2 ;;
esac

mkdir -p out
sockets=$(mktemp -d)
server=
# Ends our own server, by its process id, however we leave.
cleanup() {
  if [ -n "$server" ] && kill "$server" 2>/dev/null; then wait "$server" 2>/dev/null || true; fi
  rm -rf "$sockets"
}
trap cleanup EXIT
trap 'exit 130' INT
trap 'exit 143' TERM

started=$SECONDS
say() { printf '[%4ds] %s\n' $((SECONDS - started)) "$*"; }
# Runs a command with its output in out/NAME.log; on failure shows the end of it.
logged() {
  local name=$1
  shift
  "$@" > "out/$name.log" 2>&1 || {
    local code=$?
    tail -n 30 "out/$name.log" >&2
    echo "run.sh: $name failed; all of its output is in out/$name.log" >&2
    exit "$code"
  }
}

say "packages"
logged install cmake/install.sh run
say "build (build/release)"
logged configure cmake --preset release
logged build cmake --build build/release
facetwise=build/release/bin/facetwise

say "server"
address=unix:$sockets/facetwise.sock
"$facetwise" serve --listen "$address" > out/server.log 2>&1 &
server=$!
ready=
for _ in $(seq 100); do
  if "$facetwise" info --remote "$address" > out/info.log 2>&1; then ready=yes && break; fi
  kill -0 "$server" 2>/dev/null || break
  sleep 0.1
done
[ -n "$ready" ] || { cat out/server.log out/info.log >&2; echo "run.sh: the server did not start" >&2; exit 1; }

say "verify: batches of traced rays against the server"
rm -f out/verify.json out/report.json
logged verify "$facetwise" verify --remote "$address" --json out/verify.json
say "prove: what a BSDF should keep, by the server's exact reflections (out/proof.html)"
logged prove "$facetwise" prove "$address" --sampler exact --page out/proof.html
say "benchmark: a minute and a half (out/bench.log)"
logged bench "$facetwise" bench --quick --remote "$address" --json out/report.json
say "experiments: three minutes (out/experiments.log)"
rm -rf out/experiments
logged experiments "$facetwise" experiment --quick --folder out/experiments
logged report "$facetwise" report --bench out/report.json --verification out/verify.json --folder out/experiments \
  --output out/report.html --command "facetwise verify --remote unix:PATH --json out/verify.json" \
  --command "facetwise bench --quick --remote unix:PATH --json out/report.json"
say "done"
echo
"$facetwise" summary --report out/report.json --verification out/verify.json
echo
echo "Look at it: out/report.html. Results: out/report.json, out/verify.json. Full tables: out/bench.log."
echo "The properties that hold of exact reflections, with pictures: out/proof.html."
echo "The experiments' claims, measured: out/experiments.log; in full: facetwise experiment (about 40 minutes)."

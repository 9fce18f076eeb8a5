#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds facetwise for this machine and for arm64, and runs every test. See --help.
set -euo pipefail
cd "$(dirname "$0")"

usage() {
  cat <<'EOF'
Usage: ./test.sh [--quick | --long | --sanitize] [--help]

On a Debian 12 machine: installs the packages that are missing, builds the presets `test` (everything,
build/release) and `arm64` (the library, build/arm64), and runs all tests in one CTest run; those built
for arm64 run under qemu-aarch64 and are named arm64.*.

  --quick  only the native tests, with fewer samples and without the experiments and the report's page: nothing is
           built for arm64 or emulated
  --sanitize  instead, the engine's and the service's tests with smaller counts, with AddressSanitizer and
           UndefinedBehaviorSanitizer (build/sanitize); and with ThreadSanitizer (build/sanitize-threads) those of what the
           server's calls share and of calls as futures
  --long   also the tests that take long: the power of the chi-square test at 10^8 samples, and the like

Exit code: 0 if every test passed. CTest's own report is the end of the output.
EOF
}

long=
quick=
sanitize=
for argument in "$@"; do
  case "$argument" in
    --quick) quick=1 ;;
    --long) long=1 ;;
    --sanitize) sanitize=1 ;;
    -h | --help) usage; exit 0 ;;
    *) echo "test.sh: unknown argument \"$argument\"" >&2; usage >&2; exit 2 ;;
  esac
done

mkdir -p out
logged() {
  local name=$1
  shift
  "$@" > "out/$name.log" 2>&1 || {
    local code=$?
    tail -n 40 "out/$name.log" >&2
    echo "test.sh: $name failed; all of its output is in out/$name.log" >&2
    exit "$code"
  }
}

echo "packages"
logged install-test cmake/install.sh test
if [ -n "$sanitize" ]; then
  failed=0
  sanitized() {  # PRESET TARGETS TESTS...
    echo "build (build/$1)"
    logged "configure-$1" cmake --preset "$1"
    # shellcheck disable=SC2086
    logged "build-$1" cmake --build "build/$1" --target $2
    ctest --test-dir "build/$1" --output-on-failure -j2 "${@:3}" || failed=1
  }
  sanitized sanitize sanitized_tests -L "determinism|faults|table|fuzz|turns|service"
  # ThreadSanitizer does not see how oneTBB and gRPC, which are not instrumented, hand work from one thread to another: whatever
  # crosses them looks like a race. These tests are of what the library and the server do without them.
  sanitized sanitize-threads "test_turns test_determinism" -R '^(turns|determinism\.Async)\.'
  exit "$failed"
fi
emulated=
if [ -z "$quick" ]; then
  # arm64 first: the native build includes its tests.
  emulated=$PWD/build/arm64
  echo "build for arm64 (build/arm64)"
  logged configure-arm64 cmake --preset arm64
  logged build-arm64 cmake --build build/arm64
fi
echo "build (build/release)"
logged configure-test cmake --preset test -D FACETWISE_TESTS_FROM="$emulated"
logged build-test cmake --build build/release

export FACETWISE_LONG=$long FACETWISE_QUICK=$quick
exec ctest --test-dir build/release --output-on-failure -j2 ${quick:+-LE "report|experiments"}

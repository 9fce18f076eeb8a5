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
  --sanitize  instead, the engine's and the service's tests with smaller counts, built twice: with AddressSanitizer and
           UndefinedBehaviorSanitizer (build/sanitize), and with ThreadSanitizer (build/sanitize-threads)
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
  # Libraries that are not instrumented synchronise by means that the sanitizer does not see.
  export TSAN_OPTIONS="suppressions=$PWD/tests/thread_sanitizer.txt ${TSAN_OPTIONS:-}"
  failed=0
  for preset in sanitize sanitize-threads; do
    echo "build (build/$preset)"
    logged "configure-$preset" cmake --preset "$preset"
    logged "build-$preset" cmake --build "build/$preset" --target sanitized_tests
    # ThreadSanitizer does not know gRPC's locks, so that whatever crosses a call looks like a race: `turns` is what the
    # server's calls share, without gRPC.
    service=$([ "$preset" = sanitize ] && echo '|service' || true)
    ctest --test-dir "build/$preset" --output-on-failure -j2 -L "determinism|faults|table|fuzz|turns$service" || failed=1
  done
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

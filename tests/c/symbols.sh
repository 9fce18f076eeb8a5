#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The library shows only what facetwise.h declares, all of it, and has a versioned name: symbols.sh LIBRARY HEADER
set -euo pipefail
shown=$(nm -D --defined-only "$1" | awk '{print $3}' | sed 's/@.*//' | sort)
declared=$(grep -o '\bfw_[a-z_]*(' "$2" | tr -d '(' | sort -u)
diff <(echo "$shown") <(echo "$declared")
readelf -d "$1" | grep -q 'SONAME.*libfacetwise\.so\.[0-9]'

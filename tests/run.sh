#!/bin/sh
# All tests of all crates, optimised; no benchmark, no long validation suite.
set -eu
cd "$(dirname "$0")/.."
.ci/system-packages
cargo test --release --workspace "$@"

#!/bin/sh
# The long forms of the tests across crates: bulk laws with several seeds and sizes, optimised.
# Prints what they measure; some 25 minutes of one core. A name as argument runs only tests that hold it.
set -eu
cd "$(dirname "$0")/.."
.ci/system-packages
cargo test --release -p colluvium-tests "$@" -- --ignored --nocapture

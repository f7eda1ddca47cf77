#!/bin/sh
# The long forms of the tests of all crates: bulk laws with several seeds and sizes,
# collapses and dam breaks on several grids, optimised.
# Prints what they measure; how long all of it takes on a quiet machine was not measured (the run-out of columns alone: 18
# minutes on a busy one). A name as argument runs only the tests that hold it; the file of a test is part of
# its name (`cliffs::`). A test that fails does not keep the others from running; the exit status tells that there was one.
set -eu
cd "$(dirname "$0")/.."
.ci/system-packages
cargo test --release --no-fail-fast --workspace "$@" -- --ignored --nocapture

#!/bin/sh
# The main job, end to end: calibrates mu(I) from inclined-plane runs of grains, runs the continuum
# with the fitted law on the same slope and leaves one report. Options go on to `colluvium calibrate`.
set -eu
cd "$(dirname "$0")/.."
.ci/system-packages
out=results/incline-moderate
cargo run --release --package colluvium -- calibrate incline-moderate --out "$out" "$@"
echo "Report: $out/report.html"

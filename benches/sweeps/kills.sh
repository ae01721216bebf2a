#!/usr/bin/env bash
# Kills `sweep run --all` by SIGKILL at random moments, starts it again each time, and compares what is collected in the end
# with an uninterrupted run: the same bytes.
#
#     cargo build --release && benches/sweeps/kills.sh [KILLS] [SEED]
set -euo pipefail
cd "$(dirname "$0")/../.."

kills=${1:-20}
RANDOM=${2:-1}
augsim=${AUGSIM:-$PWD/target/release/augsim}
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
cd "$dir"

"$augsim" simulate --trajectories 40 --samples 60 --out drops.csv >/dev/null
cat >sweep.toml <<'SWEEP'
command = "train"

[options]
data = "drops.csv"
pybullet_ball = true
iterations = 1500
checkpoint_every = 50

[cross]
recipe = ["hybrid", "hybrid-plus"]
seed = { from = 1, to = 8 }
SWEEP
"$augsim" sweep plan sweep.toml --out whole >/dev/null
"$augsim" sweep plan sweep.toml --out killed >/dev/null
started=$(date +%s%N)
"$augsim" sweep run whole --all --threads 2
took_ms=$((($(date +%s%N) - started) / 1000000))

done_now() { find killed/results -name '[!.]*.json' 2>/dev/null | wc -l; }
for k in $(seq "$kills"); do
    "$augsim" sweep run killed --all --threads 2 --quiet >/dev/null 2>&1 &
    run=$!
    # So long that the kills spread over the whole sweep, wherever in a task, a checkpoint or a rename they fall.
    pause_ms=$((RANDOM % (2 * took_ms / kills + 1)))
    sleep "$(printf '%d.%03d' $((pause_ms / 1000)) $((pause_ms % 1000)))"
    kill -KILL "$run" 2>/dev/null || true
    wait "$run" 2>/dev/null || true
    echo "kill $k after $pause_ms ms: $(done_now) of 16 tasks done"
done
"$augsim" sweep run killed --all --threads 2
for plan in whole killed; do "$augsim" sweep collect "$plan" >/dev/null; done
for file in result.json table.csv report.html; do cmp "whole/collected/$file" "killed/collected/$file"; done
left=$(find killed -name '.*.tmp' | wc -l)
echo "equal bytes after $kills kills; $left temporary files left"
[ "$left" = 0 ]

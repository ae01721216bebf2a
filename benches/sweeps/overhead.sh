#!/usr/bin/env bash
# What a sweep costs beside its tasks: 1,000 tasks of about a second, and a plan of 100,000 tasks.
#
#     cargo build --release && benches/sweeps/overhead.sh [TASKS] [ITERATIONS] [WORKERS]
#
# Work is the time that the commands themselves ran, measured around each; overhead is everything else that the workers and
# the person who waits spend on plan, run and collect. ITERATIONS makes a task last about a second.
set -euo pipefail
cd "$(dirname "$0")/../.."

tasks=${1:-1000}
iterations=${2:-2000}
workers=${3:-2}
augsim=${AUGSIM:-$PWD/target/release/augsim}
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
cd "$dir"

"$augsim" simulate --trajectories 40 --samples 40 --out drops.csv >/dev/null
sweep() { # SEEDS ITERATIONS
    cat <<SWEEP
command = "train"

[options]
data = "drops.csv"
pybullet_ball = true

[cross]
iterations = $2
seed = { from = 1, to = $1 }
SWEEP
}
sweep "$tasks" "[$iterations]" >thousand.toml
sweep 50000 "[1000, 2000]" >many.toml

now() { date +%s.%N; }
began=$(now)
"$augsim" sweep plan thousand.toml --out plan >/dev/null
planned=$(now)
"$augsim" sweep run plan --all --threads "$workers"
ran=$(now)
"$augsim" sweep collect plan >/dev/null
collected=$(now)
cat plan/work/*/timing.json | tr '}' '\n' | awk -F: -v workers="$workers" -v n="$tasks" \
    -v plan="$(echo "$planned - $began" | bc)" -v run="$(echo "$ran - $planned" | bc)" \
    -v collect="$(echo "$collected - $ran" | bc)" '
    /seconds/ { work += $2 }
    END {
        overhead = workers * (run + plan + collect) - work
        printf "%d tasks of %.2f s by %d workers: plan %.2f s, run %.1f s, collect %.2f s\n", n, work / n, workers, plan, run, collect
        printf "overhead %.2f %% of the work\n", 100 * overhead / work
        exit overhead > 0.05 * work
    }'

/usr/bin/env time -f "100,000 tasks planned in %e s with %M kB" "$augsim" sweep plan many.toml --out many >/dev/null

#!/usr/bin/env bash
# A sweep on a real Slurm: a controller and three virtual nodes on this machine, started by hand and ended again.
#
#     cargo build --release && benches/sweeps/slurm.sh [TASKS] [ITERATIONS]
#
# The tasks (24 trainings without numbers) run over the nodes; one node is taken down while it works, one task is killed by
# SIGKILL. What is collected afterwards must be the bytes that `sweep run --all` makes without any of it. Needs root, and
# installs Slurm by apt-get where it is missing; where that cannot be done it says so loudly and succeeds. `AUGSIM` names
# another binary than target/release/augsim.
set -euo pipefail
cd "$(dirname "$0")/../.."

tasks=${1:-24}
iterations=${2:-2000}
augsim=${AUGSIM:-$PWD/target/release/augsim}

skip() {
    echo "NOT RUN: a sweep on Slurm, because $1" >&2
    exit 0
}
fail() {
    echo "slurm.sh: $1" >&2
    tail -n 20 "$dir"/*.log "$dir"/there/slurm/*.log >&2 || true
    exit 1
}

[ "$(id -u)" = 0 ] || skip "only root may start its daemons"
if ! command -v slurmctld >/dev/null || ! command -v slurmd >/dev/null || ! command -v munged >/dev/null; then
    { apt-get update -qq && apt-get install -y -qq --no-install-recommends slurm-wlm munge; } >&2 ||
        skip "slurm-wlm and munge cannot be installed"
fi

dir=$(mktemp -d)
daemons=()
end() {
    # Jobs of this Slurm alone: SLURM_CONF says which it is.
    scancel --user=root 2>/dev/null || true
    for daemon in "${daemons[@]}"; do kill "$daemon" 2>/dev/null || true; done
    wait 2>/dev/null || true
    rm -rf "$dir"
}
trap end EXIT

# A key and a socket of our own, whatever else runs on this machine.
export SLURM_CONF=$dir/slurm.conf
mkdir -p "$dir/state" "$dir/spool"
chmod 755 "$dir"
dd if=/dev/urandom of="$dir/munge.key" bs=128 count=1 status=none
chmod 400 "$dir/munge.key"
cat >"$SLURM_CONF" <<CONF
ClusterName=sweeps
SlurmctldHost=$(hostname)
SlurmctldPort=16817
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=$dir/munge.socket,cred_expire=5
CredType=cred/munge
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
AccountingStorageType=accounting_storage/none
JobAcctGatherType=jobacct_gather/none
MpiDefault=none
ReturnToService=2
KillWait=2
SchedulerParameters=bf_interval=1,sched_interval=2
SlurmdParameters=config_overrides
StateSaveLocation=$dir/state
SlurmdSpoolDir=$dir/spool/%n
SlurmctldPidFile=$dir/slurmctld.pid
SlurmdPidFile=$dir/slurmd.%n.pid
SlurmctldLogFile=$dir/slurmctld.log
SlurmdLogFile=$dir/slurmd.%n.log
$(for i in 1 2 3; do echo "NodeName=n$i NodeHostname=$(hostname) Port=1682$i CPUs=1 State=UNKNOWN"; done)
PartitionName=all Nodes=n1,n2,n3 Default=YES MaxTime=INFINITE State=UP
CONF

munged --foreground --force --key-file="$dir/munge.key" --socket="$dir/munge.socket" --pid-file="$dir/munge.pid" \
    --log-file="$dir/munge.log" --seed-file="$dir/munge.seed" --num-threads=2 >"$dir/munged.out.log" 2>&1 &
daemons+=($!)
for _ in $(seq 50); do [ -S "$dir/munge.socket" ] && break; sleep 0.1; done
[ -S "$dir/munge.socket" ] || { cat "$dir"/munge*.log >&2; skip "munged does not start here"; }
slurmctld -D -f "$SLURM_CONF" >"$dir/slurmctld.out.log" 2>&1 &
daemons+=($!)
for i in 1 2 3; do
    slurmd -D -f "$SLURM_CONF" -N "n$i" >"$dir/slurmd.n$i.out.log" 2>&1 &
    daemons+=($!)
done
idle() { [ "$(sinfo --noheader --Node --format=%T 2>/dev/null | grep -c '^idle')" = "$1" ]; }
for _ in $(seq 100); do idle 3 && break; sleep 0.2; done
idle 3 || { tail -n 5 "$dir"/slurm*.log >&2; skip "its daemons do not start here"; }
echo "Slurm $(sinfo --version | cut -d' ' -f2): three nodes"

cd "$dir"
"$augsim" simulate --trajectories 40 --samples 60 --out drops.csv --quiet >/dev/null
cat >sweep.toml <<SWEEP
command = "train"

[options]
data = "drops.csv"
pybullet_ball = true
iterations = $iterations
checkpoint_every = 100

[cross]
recipe = ["hybrid", "hybrid-plus"]
seed = { from = 1, to = $((tasks / 2)) }
SWEEP
"$augsim" sweep plan sweep.toml --out here >/dev/null
"$augsim" sweep plan sweep.toml --out there >/dev/null
"$augsim" sweep submit there --max-parallel 3 --time 60

done_now() { find there/results -name '*.json' 2>/dev/null | wc -l; }
wait_for() { # SENTENCE COMMAND...
    local what=$1
    shift
    for _ in $(seq 3000); do "$@" && return; sleep 0.1; done
    squeue >&2
    fail "it never came to this: $what"
}

ended() { [ -z "$(squeue --noheader 2>/dev/null)" ]; }

# In the middle of the work: a node goes down, and a task on another one is killed.
runs_on() { squeue --noheader --states=R --nodelist="$1" --format=%i 2>/dev/null | grep -q .; }
middle() {
    # Where the queue is empty so early, every task has failed: their logs say why.
    ! ended || fail "all jobs have ended with $(done_now) of $tasks tasks done"
    [ "$(done_now)" -ge $((tasks / 6)) ] && runs_on n2
}
wait_for "a sixth is done and n2 works" middle
down=$(squeue --noheader --states=R --nodelist=n2 --format=%i)
scontrol update nodename=n2 state=down reason=test
echo "n2 is down while it runs $down"
training() { # Process of a task on a node that is up.
    local process
    for process in $(pgrep --full "^$augsim .*train .*--out=$dir/there/work/"); do
        if tr '\0' '\n' <"/proc/$process/environ" | grep -q '^SLURMD_NODENAME=n[13]$'; then
            echo "$process"
            return
        fi
    done 2>/dev/null
    return 1
}
# A task that ends by itself at this very moment is not killed; then it is the next one.
killed() {
    victim=$(training) && kill -KILL "$victim" 2>/dev/null && sleep 1 && grep -qs "killed by SIGKILL" there/slurm/*.log
}
wait_for "a task is killed" killed
echo "killed process $victim of a task, with $(done_now) of $tasks done"

wait_for "all jobs have ended" ended
"$augsim" sweep status there
grep -h "^  task .* killed by" there/slurm/*.log

# The same tasks without a cluster, and without anything going wrong.
"$augsim" sweep run here --all --threads 2
"$augsim" sweep collect here --quiet >/dev/null
for file in result.json table.csv report.html; do
    cmp "here/collected/$file" "there/collected/$file" || fail "$file differs"
done
echo "equal bytes: $tasks tasks over three nodes, one node down, one task killed"

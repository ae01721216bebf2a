#!/usr/bin/env python3
"""augsim against PyTorch and JAX on the same work, interleaved in one run.

Each peer is a process of its own that waits while the others compute; every round asks each of them once, in
turn, after a pause in which the threads of the one before stop waiting for work in a loop. Printed: medians over
the rounds of wall and CPU time a call, peak resident memory, and ratios (the peer's over ours; the median of the
ratios of one round, so that a slow moment of the machine hits all).

    python3 -m venv .venv && .venv/bin/pip install torch jax
    cargo build --release -p augsim-benches --bin peer
    .venv/bin/python benches/peers/compare.py [--rounds 12] [--threads 2] [--json FILE] [CASE ...]
"""
import argparse
import json
import os
import statistics
import subprocess
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))
CASES = {
    "train_ball": "training iteration, ball (batch 100, 400 steps)",
    "train_push": "training iteration, push (batch 100, 300 steps, feature nets)",
    "sample": "2,000 sampled trajectories of 400 steps",
    "step": "one step of one trajectory",
}
# Calls a round, so that a round of a peer takes some tenths of a second.
CALLS = {
    "train_ball": {"augsim": 10, "torch": 1, "jax": 1},
    "train_push": {"augsim": 8, "torch": 1},
    "sample": {"augsim": 2, "torch": 1, "jax": 1},
    "step": {"augsim": 100_000, "torch": 500, "jax": 2000},
}


class Peer:
    def __init__(self, name, case, threads, binary):
        self.calls = CALLS[case][name]
        script = [sys.executable, os.path.join(HERE, f"{name}_peer.py")]
        command = [binary] if name == "augsim" else script
        pipes = dict(stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.process = subprocess.Popen(command + [case, str(threads)], **pipes)
        if self.process.stdout.readline().strip() != "ready":
            sys.exit(f"{name} did not start; see its message above")

    def ask(self):
        time.sleep(0.3)
        self.process.stdin.write(f"{self.calls}\n")
        self.process.stdin.flush()
        return json.loads(self.process.stdout.readline())


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cases", nargs="*", metavar="CASE", help=", ".join(CASES))
    parser.add_argument("--rounds", type=int, default=12)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--json", metavar="FILE", help="raw figures of every round")
    default = os.path.join(HERE, "..", "..", "target", "release", "peer")
    parser.add_argument("--binary", default=default, help="our side")
    args = parser.parse_args()
    raw = {}
    print(f"{args.threads} threads, {args.rounds} rounds")
    print(f"{'':10}{'wall ms':>12}{'CPU ms':>12}{'MB':>8}{'wall ratio':>12}{'CPU ratio':>12}")
    for case in args.cases or CASES:
        peers = {name: Peer(name, case, args.threads, args.binary) for name in CALLS[case]}
        rounds = [{name: peer.ask() for name, peer in peers.items()} for _ in range(args.rounds)]
        for peer in peers.values():
            peer.process.stdin.close()
            peer.process.wait()
        raw[case] = rounds
        print(CASES[case])
        for name in peers:
            middle = lambda key: statistics.median(r[name][key] for r in rounds)
            ratio = lambda key: statistics.median(r[name][key] / r["augsim"][key] for r in rounds)
            figures = f"  {name:8}{middle('wall_s') * 1e3:12.4g}{middle('cpu_s') * 1e3:12.4g}{middle('rss_mb'):8.0f}"
            print(figures + (f"{ratio('wall_s'):12.1f}{ratio('cpu_s'):12.1f}" if name != "augsim" else ""))
    if args.json:
        with open(args.json, "w") as out:
            json.dump(raw, out, indent=1)


main()

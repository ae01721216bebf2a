"""The stepper and sampling from Python against the same work in Rust (`cargo build --release --workspace --bins`, program `peer`).

python crates/python/benches/speed.py [ROUNDS]

CPU seconds of one thread each, in interleaved rounds: ratios are medians over the rounds, with the least and the largest.
"""

import json
import os
import statistics
import subprocess
import sys
import time
from pathlib import Path

os.environ["RAYON_NUM_THREADS"] = "1"

import augsim  # noqa: E402
from augsim import generate  # noqa: E402

ROOT = Path(__file__).resolve().parents[3]
PEER = ROOT / os.environ.get("CARGO_TARGET_DIR", "target") / "release" / "peer"


class Peer:
    """A case of the Rust program, which answers a number of calls with seconds a call."""

    def __init__(self, case):
        command = [str(PEER), case, "1"]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        assert self.process.stdout.readline() == "ready\n"

    def seconds(self, calls):
        self.process.stdin.write(f"{calls}\n")
        self.process.stdin.flush()
        return json.loads(self.process.stdout.readline())["cpu_s"]


def seconds(work, calls):
    """CPU seconds of one call."""
    begun = time.process_time()
    for _ in range(calls):
        work()
    return (time.process_time() - begun) / calls


def main(rounds):
    run = augsim.train(generate.drops(20, samples=50), "hybrid", "pybullet-ball", iterations=1, progress=False)
    stepper = run.stepper()
    stepper.begin([4.5, 0.0])
    cases = [
        ("one step of one trajectory", "step", 20_000, stepper.step),
        ("2,000 samples of 400 steps", "sample", 2, lambda: run.sample([4.5, 0.0], 400, 2000)),
    ]
    for name, case, calls, work in cases:
        peer, ratios, ours = Peer(case), [], []
        seconds(work, 2)
        for _ in range(rounds):
            theirs, mine = peer.seconds(calls), seconds(work, calls)
            ratios.append(mine / theirs)
            ours.append(mine)
        low, high = min(ratios), max(ratios)
        print(f"{name}: {1e6 * statistics.median(ours):.1f} µs, {statistics.median(ratios):.2f} times Rust ({low:.2f} to {high:.2f})")
        peer.process.stdin.close()
        peer.process.wait()


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 9)

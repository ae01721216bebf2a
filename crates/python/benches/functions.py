"""Time of a discovery with a model file, with the same rates as a function that is read as formulas, and as one that is called.

python crates/python/benches/functions.py [SYSTEM ...]     # pendulum, motor, arm; CPU seconds of all threads

A called function takes minutes for the motor and the arm; `--read` leaves it out.
"""

import sys
import time
from pathlib import Path

import augsim

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
import systems  # noqa: E402


def seconds(model, data):
    """CPU seconds of a discovery, and what it found."""
    begun = time.process_time()
    found = augsim.discover(model, data, progress=False)
    return time.process_time() - begun, ", ".join(effect["kind"] for effect in found.effects)


def main(names, is_read_alone):
    for name in names:
        system, calls = systems.ALL[name], {}
        data = system.recording()
        calls["model file"] = augsim.Model(system.text)
        calls["read function"] = augsim.Model.from_rates(system.function, **system.arguments)
        if not is_read_alone:
            calls["called function"] = augsim.Model.from_rates(system.function, trace=False, **system.arguments)
        first = None
        for kind, model in calls.items():
            taken, found = seconds(model, data)
            first = first or taken
            print(f"{name}, {kind}: {taken:.2f} s, {taken / first:.2f} times the model file: {found}", flush=True)


if __name__ == "__main__":
    words = sys.argv[1:]
    main([word for word in words if word in systems.ALL] or list(systems.ALL), "--read" in words)

"""Contract (issue 20): Ctrl-C stops long work promptly: the caller checks for signals at least twenty times a second, whether the work
reports progress often (training), rarely (a search) or never (a fit). Each case runs in a separate process, because the signal is for
the whole process."""

import pytest

from interrupting import seconds_to_stop

# Seconds from the signal to the exception: a look every 0.05 s, on processors that the work keeps busy.
PROMPT = 1.5

CALLS = {
    "discover": "augsim.discover(sealed / 'model.toml', sealed / 'bounces.csv', progress=False)",
    # Ten iterations of so small a net are done before the caller would look after a pause.
    "train": "augsim.train(drops, 'neural', 'pybullet-ball', iterations=10**7, progress=False)",
    "train with progress": "augsim.train(drops, 'neural', 'pybullet-ball', iterations=10**7, progress=lambda step, share: None)",
    "fit": "augsim.Model(pendulum / 'model.toml').fit(pendulum / 'swings.csv')",
}


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS.keys())
def test_ctrl_c_ends_it_promptly(root, call):
    script = f"""
        import pathlib
        import signal
        import augsim
        from augsim import generate
        sealed = pathlib.Path({str(root / "fixtures" / "sealed")!r})
        pendulum = pathlib.Path({str(root / "fixtures" / "systems" / "pendulum")!r})
        drops = generate.drops(8, samples=20, seed=7)
        # Work that a shell starts in the background inherits that the signal is ignored.
        signal.signal(signal.SIGINT, signal.default_int_handler)
        print("ready", flush=True)
        try:
            while True:
                {call}
        except KeyboardInterrupt:
            print("stopped", flush=True)
    """
    seconds = seconds_to_stop(script, 0.5)
    assert seconds < PROMPT, f"{seconds:.2f} s"

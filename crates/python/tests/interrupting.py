"""Presses Ctrl-C in a program of its own, because the signal is for the whole process."""

import signal
import subprocess
import sys
import textwrap
import threading
import time


def seconds_to_stop(program, running_s):
    """Runs a program that prints ``ready``, sends it SIGINT after ``running_s`` seconds, and returns the seconds until it prints
    ``stopped``; it must end with code 0 and without errors."""
    process = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(program)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    limit = threading.Timer(60.0, process.kill)
    limit.start()
    try:
        assert process.stdout.readline() == "ready\n"
        time.sleep(running_s)
        begun = time.monotonic()
        process.send_signal(signal.SIGINT)
        assert process.stdout.readline() == "stopped\n"
        seconds = time.monotonic() - begun
        _, errors = process.communicate(timeout=30)
    finally:
        limit.cancel()
        process.kill()
    assert process.returncode == 0 and errors == "", errors
    return seconds

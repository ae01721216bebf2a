"""Shared fixtures. Cargo builds the command line program for comparisons unless AUGSIM_BINARY names one."""

import os
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="session")
def root() -> Path:
    """Root folder of the repository."""
    return ROOT


@pytest.fixture(scope="session")
def sealed() -> Path:
    """Folder of throws with drag that their model file does not declare."""
    return ROOT / "fixtures" / "sealed"


@pytest.fixture(scope="session")
def augsim_command():
    """Runs the command line and returns its output."""
    binary = os.environ.get("AUGSIM_BINARY")
    if binary is None:
        subprocess.run(["cargo", "build", "--release", "--workspace", "--bins"], cwd=ROOT, check=True)
        binary = ROOT / os.environ.get("CARGO_TARGET_DIR", "target") / "release" / "augsim"

    def run(*words: object) -> str:
        command = [str(binary), *map(str, words)]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout

    return run

"""Contract: the examples run, print the expected text, and each notebook has the cells of its script."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
SCRIPTS = sorted(EXAMPLES.glob("*.py"))

#: Expected text of each example, with short settings.
PRINTS = {
    "closing_the_loop": r"The model lacks quadratic-drag.*declared: ([\d.]+) mm.*augmented: ([\d.]+) mm.*90 % band of the height",
    "forecasting_pushes": r"Hybrid\+: [\d.]+ mm from the measured position, \d+ % within the 90 % band.*declared physics: [\d.]+ mm",
    "planning_pushes": r"calibrated physics: [\d.]+ \[.* mm from the goal, reached in.*Hybrid\+: [\d.]+ \[.*difference: ",
}


def cells(script: str) -> list[tuple[str, str]]:
    """Kind and text of the cells of a script; cells begin with `# %%`."""
    parts = re.split(r"^# %%(.*)\n", script, flags=re.M)[1:]
    made = []
    for kind, text in zip(parts[::2], parts[1::2]):
        if "markdown" in kind:
            lines = (line.removeprefix("#").removeprefix(" ") for line in text.strip().splitlines())
            made.append(("markdown", "\n".join(lines)))
        else:
            made.append(("code", text.strip()))
    return made


def test_every_example_is_tested():
    assert [s.stem for s in SCRIPTS] == sorted(PRINTS) == sorted(p.stem for p in EXAMPLES.glob("*.ipynb"))


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda s: s.stem)
def test_an_example_prints_the_expected_text(script):
    run = subprocess.run(
        [sys.executable, str(script)], capture_output=True, text=True, env=os.environ | {"AUGSIM_EXAMPLES_QUICK": "1"}
    )
    assert run.returncode == 0, run.stderr
    assert run.stderr == ""
    printed = re.search(PRINTS[script.stem], run.stdout, flags=re.S)
    assert printed, run.stdout
    if script.stem == "closing_the_loop":
        declared, augmented = map(float, printed.groups())
        assert augmented < 0.5 * declared


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda s: s.stem)
def test_a_notebook_has_the_cells_of_its_script(script):
    notebook = json.loads(script.with_suffix(".ipynb").read_text())
    there = [(cell["cell_type"], "".join(cell["source"]).strip()) for cell in notebook["cells"]]
    assert there == cells(script.read_text())
    assert all(not cell.get("outputs") for cell in notebook["cells"])

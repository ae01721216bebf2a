"""Contract (issue 53): MuJoCo is a declared model, and what its description lacks is found through its own steps."""

import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("mujoco", minversion="3.3", reason="the wheel of MuJoCo is not installed: pip install 'mujoco>=3.3'")

EXAMPLE = Path(__file__).resolve().parents[1] / "examples" / "simulators"


def test_friction_and_payload_of_an_arm_are_found(monkeypatch):
    monkeypatch.syspath_prepend(EXAMPLE)
    import arm_in_mujoco as example

    import augsim

    # The example tries the whole library, which takes minutes.
    rivals = ["coulomb", "linear-damping"]
    found = augsim.discover(example.declared(), example.recording(runs=3), only=rivals, null_runs=0, progress=False)
    friction = {effect["kind"]: effect["parameters"]["f"]["value"] for effect in found.effects}
    assert friction == {
        "coulomb on shoulder_N_m": pytest.approx(0.25, rel=0.05),
        "coulomb on elbow_N_m": pytest.approx(0.12, rel=0.05),
    }
    payload = found.model.parameters["payload_kg"]
    assert payload.value == pytest.approx(0.15, rel=0.02) and payload.ci95[0] < 0.15 < payload.ci95[1]


def test_the_steps_of_the_model_are_those_of_mujoco():
    program = """
import arm_in_mujoco as e, numpy as np, mujoco
arm, times = e.declared(), np.arange(51) * 0.02
torque = {"torque1_N_m": np.sin(3 * times), "torque2_N_m": 0.2 * np.cos(5 * times)}
made = arm.simulate({"q1_rad": 0.4, "q2_rad": -0.2, "w1_rad_s": 0.0, "w2_rad_s": 0.0}, times, torque)[0, 0]
model = e.Arm().with_payload(0.0, 0.005)
data = mujoco.MjData(model)
data.qpos[:] = 0.4, -0.2
for k in range(51):
    assert np.allclose(data.qpos, made[k], rtol=0.0, atol=1e-9), (k, data.qpos, made[k])
    data.ctrl[:] = [torque["torque1_N_m"][k], torque["torque2_N_m"][k]]
    for _ in range(4):
        mujoco.mj_step(model, data)
"""
    run = subprocess.run([sys.executable, "-c", program], cwd=EXAMPLE, capture_output=True, text=True)
    assert run.returncode == 0 and run.stderr == "", run.stderr

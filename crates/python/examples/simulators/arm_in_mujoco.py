"""What a MuJoCo model lacks: the friction of its joints, and the mass of a payload.

    python crates/python/examples/simulators/arm_in_mujoco.py          # needs mujoco 3.3 or later; about two minutes

The declared model is MuJoCo itself: `Model.from_step` steps many states at once with `mujoco.rollout`. Effects are added to
`qfrc_applied`. The recording is simulated here, with friction and a payload that the MJCF text does not have.
"""

import copy
import time

import mujoco
import numpy as np
from mujoco import rollout

import augsim

ARM = """
<mujoco model="arm">
  <option timestep="0.005" gravity="0 0 -9.81"><flag contact="disable" constraint="disable" autoreset="disable"/></option>
  <worldbody>
    <body name="upper">
      <joint name="shoulder" axis="0 1 0" damping="0.05"/>
      <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.03" mass="1.2"/>
      <body name="fore" pos="0 0 -0.3">
        <joint name="elbow" axis="0 1 0" damping="0.05"/>
        <geom type="capsule" fromto="0 0 0 0 0 -0.25" size="0.025" mass="0.8"/>
        <body name="tool" pos="0 0 -0.25"><inertial pos="0 0 0" mass="1e-6" diaginertia="1e-9 1e-9 1e-9"/></body>
      </body>
    </body>
  </worldbody>
  <actuator><motor joint="shoulder"/><motor joint="elbow"/></actuator>
</mujoco>
"""
# A search tries parameters with which the simulation diverges: MuJoCo then has to return what is not finite (`autoreset` above),
# and not to write a warning for each.
mujoco.set_mju_user_warning(lambda text: None)
#: What is applied in each step: the controls of the motors, and `qfrc_applied`.
APPLIED = int(mujoco.mjtState.mjSTATE_CTRL | mujoco.mjtState.mjSTATE_QFRC_APPLIED)
#: What the recording has and the MJCF text lacks: mass at the tool in kg, dry friction of the joints in N m.
PAYLOAD_KG, FRICTION_N_M = 0.15, np.array([0.25, 0.12])


class Arm:
    """Steps the arm for many states, controls and payloads at once."""

    def __init__(self):
        self.model = mujoco.MjModel.from_xml_string(ARM)
        self.data = mujoco.MjData(self.model)
        self.variants = {}
        self.rollout = rollout.Rollout(nthread=0)

    def with_payload(self, mass, dt):
        """The model with this mass at the tool, kg."""
        if (mass, dt) not in self.variants:
            if len(self.variants) > 100:
                self.variants.clear()
            variant = copy.copy(self.model)
            variant.opt.timestep = dt
            variant.body("tool").mass[:] = 1e-6 + mass
            mujoco.mj_setConst(variant, self.data)
            self.variants[mass, dt] = variant
        return self.variants[mass, dt]

    def step(self, x, u, p, dt):
        """The states [q1, q2, w1, w2] after dt seconds; u has the controls of both motors, then qfrc_applied of both joints."""
        points = x.shape[1]
        masses = p["payload_kg"].tolist()
        with_mass = {mass: self.with_payload(mass, dt) for mass in set(masses)}
        models = [with_mass[mass] for mass in masses]
        first = np.zeros((points, 5))  # time, positions, speeds
        first[:, 1:] = x.T
        applied = np.ascontiguousarray(np.asarray(u).T)[:, None]
        last, sensors = np.empty((points, 1, 5)), np.empty((points, 1, 0))
        # Unchecked, because the checks take as long as the steps; the shapes are those that it would make.
        self.rollout.rollout(
            models, [self.data], first, applied, control_spec=APPLIED, nstep=1, skip_checks=True, state=last, sensordata=sensors
        )
        return last[:, 0, 1:].T


def recording(runs=4, seconds=1.0, sample_s=0.02):
    """Simulated recordings of the true arm: torques of the motors, and angles of an encoder with 1 mrad of noise."""
    random = np.random.default_rng(1)
    arm = Arm()
    model = arm.with_payload(PAYLOAD_KG, 0.005)
    data = mujoco.MjData(model)
    columns = ("trajectory", "t_s", "torque1_N_m", "torque2_N_m", "angle1_rad", "angle2_rad")
    rows = []
    for run in range(runs):
        mujoco.mj_resetData(model, data)
        data.qpos[:] = random.uniform(-1.0, 1.0, 2)
        size = random.uniform(0.6, 1.6, (2, 3)) * [[1.5], [0.6]]
        frequency_hz, phase = random.uniform(0.3, 1.8, (2, 3)), random.uniform(0.0, 6.28, (2, 3))
        for t in np.arange(round(seconds / sample_s) + 1) * sample_s:
            torque = (size * np.sin(2 * np.pi * frequency_hz * t + phase)).sum(axis=1)
            rows.append((run, t, *torque, *(data.qpos + random.normal(0.0, 0.001, 2))))
            for _ in range(round(sample_s / model.opt.timestep)):
                data.ctrl[:] = torque
                data.qfrc_applied[:] = -FRICTION_N_M * np.tanh(data.qvel / 0.05)
                mujoco.mj_step(model, data)
    return dict(zip(columns, np.array(rows).T))


def declared():
    """The arm of the MJCF text as a model of augsim."""
    return augsim.Model.from_step(
        Arm().step,
        dt=0.005,
        name="arm",
        states=["q1_rad", "q2_rad", "w1_rad_s", "w2_rad_s"],
        inputs={"torque1_N_m": "zero", "torque2_N_m": "zero"},
        forces={"shoulder_N_m": ("q1_rad", "w1_rad_s"), "elbow_N_m": ("q2_rad", "w2_rad_s")},
        parameters={"payload_kg": (0.0, 0.0, 1.0)},
        outputs={"angle1_rad": "q1_rad", "angle2_rad": "q2_rad"},
        scales={"payload_kg": 0.1, "shoulder_N_m": 0.1, "elbow_N_m": 0.1},
    )


if __name__ == "__main__":
    begun = time.monotonic()
    found = augsim.discover(declared(), recording())
    payload = found.model.parameters["payload_kg"]
    print(found.sentence)
    print(f"payload: {payload.value:.4f} kg, 95 % interval {payload.ci95}; {time.monotonic() - begun:.0f} s")

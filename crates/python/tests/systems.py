"""Three systems as model files and as functions of Python, with recordings of systems that have dry friction as well."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np


@dataclass(frozen=True)
class System:
    """A system as a model file and as a function of Python."""

    text: str
    function: Callable[..., Any]
    arguments: dict[str, Any]
    #: Rates of the true system, which has an effect that the model lacks.
    truth: Callable[..., Any]
    outputs: dict[str, int]
    #: Inputs as functions of time.
    inputs: dict[str, Callable[[np.ndarray], np.ndarray]] = field(default_factory=dict)
    starts: tuple[tuple[float, ...], ...] = ()
    duration_s: float = 4.0
    noise: float = 0.002

    def recording(self, seed: int = 1, samples: int = 201) -> dict[str, Any]:
        """Recordings of the true system, one for each start."""
        random = np.random.default_rng(seed)
        times = np.linspace(0.0, self.duration_s, samples)
        table: dict[str, list[np.ndarray]] = {name: [] for name in ["trajectory", "t_s", *self.inputs, *self.outputs]}
        for number, start in enumerate(self.starts):
            held = {name: given(times) for name, given in self.inputs.items()}
            states = self._simulated(np.array(start), times, held)
            table["trajectory"].append(np.full(samples, number))
            table["t_s"].append(times)
            for name, values in held.items():
                table[name].append(values)
            for name, state in self.outputs.items():
                table[name].append(states[:, state] + random.normal(0.0, self.noise, samples))
        return {name: np.concatenate(parts) for name, parts in table.items()}

    def _simulated(self, x: np.ndarray, times: np.ndarray, held: dict[str, np.ndarray]) -> np.ndarray:
        states = [x]
        for k, (begin, end) in enumerate(zip(times, times[1:])):
            u = [values[k] for values in held.values()]
            steps = 40
            h = (end - begin) / steps
            for _ in range(steps):
                a = np.array(self.truth(x, u))
                b = np.array(self.truth(x + h / 2 * a, u))
                c = np.array(self.truth(x + h / 2 * b, u))
                d = np.array(self.truth(x + h * c, u))
                x = x + h / 6 * (a + 2 * b + 2 * c + d)
            states.append(x)
        return np.array(states)


def pendulum(t, x, u, p):
    theta, omega = x
    return [omega, -p["gravity_m_s2"] / p["length_m"] * np.sin(theta) - p["damping_per_s"] * omega]


def motor(t, x, u, p):
    current, angle, speed = x
    volt = u["voltage_V"] - p["resistance_ohm"] * current - p["constant_V_s"] * speed
    torque = p["constant_V_s"] * current - p["damping_N_m_s"] * speed
    return np.stack([volt / p["inductance_H"], speed, torque / p["inertia_kg_m2"]])


def arm(t, x, u, p):
    q1, q2, w1, w2 = x
    m1, m2, l1, g = p["mass1_kg"], p["mass2_kg"], 0.4, 9.81
    c1, c2 = 0.2, 0.15
    i1, i2 = m1 * l1**2 / 12.0, m2 * (2 * c2) ** 2 / 12.0
    a = i1 + i2 + m1 * c1**2 + m2 * (l1**2 + c2**2)
    b, d = m2 * l1 * c2, i2 + m2 * c2**2
    m11, m12, m22 = a + 2 * b * np.cos(q2), d + b * np.cos(q2), d
    h = b * np.sin(q2)
    r1 = u["torque1_N_m"] + h * (2 * w1 * w2 + w2**2) - (m1 * c1 + m2 * l1) * g * np.sin(q1) - m2 * c2 * g * np.sin(q1 + q2)
    r2 = u["torque2_N_m"] - h * w1**2 - m2 * c2 * g * np.sin(q1 + q2)
    determinant = m11 * m22 - m12 * m12
    rates = np.empty_like(x)
    rates[0], rates[1] = w1, w2
    rates[2] = (m22 * r1 - m12 * r2) / determinant
    rates[3] = (m11 * r2 - m12 * r1) / determinant
    return rates


def _true_pendulum(x, u):
    rates = pendulum(0.0, x, u, {"gravity_m_s2": 9.81, "length_m": 0.6, "damping_per_s": 0.08})
    return [rates[0], rates[1] - 0.4 * np.tanh(x[1] / 0.05)]


def _true_motor(x, u):
    values = {"resistance_ohm": 2.0, "inductance_H": 0.02, "constant_V_s": 0.05, "damping_N_m_s": 2e-5, "inertia_kg_m2": 3e-4}
    rates = motor(0.0, x, {"voltage_V": u[0]}, values)
    return [rates[0], rates[1], rates[2] - 12.0 * np.tanh(x[2] / 0.5)]


def _true_arm(x, u):
    rates = arm(0.0, x, {"torque1_N_m": u[0], "torque2_N_m": u[1]}, {"mass1_kg": 1.0, "mass2_kg": 0.8})
    return [*rates[:3], rates[3] - 4.0 * np.tanh(x[3] / 0.05)]


PENDULUM = System(
    text="""
scenario = "system"
name = "pendulum"
[states]
theta_rad = { start = "angle_rad" }
omega_rad_s = { start = "slope(angle_rad)" }
[parameters]
gravity_m_s2 = { nominal = 9.81, frozen = true }
length_m = { nominal = 0.55, min = 0.1, max = 2.0 }
damping_per_s = { nominal = 0.05, min = 0.0, max = 5.0 }
[rates]
theta_rad = "omega_rad_s"
omega_rad_s = "-gravity_m_s2 / length_m * sin(theta_rad) - damping_per_s * omega_rad_s"
[outputs]
angle_rad = { value = "theta_rad", sd = "estimate" }
""",
    function=pendulum,
    arguments={
        "states": ["theta_rad", "omega_rad_s"],
        "parameters": {
            "gravity_m_s2": {"nominal": 9.81, "frozen": True},
            "length_m": (0.55, 0.1, 2.0),
            "damping_per_s": (0.05, 0.0, 5.0),
        },
        "outputs": {"angle_rad": "theta_rad"},
    },
    truth=_true_pendulum,
    outputs={"angle_rad": 0},
    starts=((1.2, 0.0), (-0.9, 0.5), (0.6, 2.0)),
)

MOTOR = System(
    text="""
scenario = "system"
name = "motor"
[inputs]
voltage_V = { hold = "zero" }
[states]
current_A = { start = "measured_A" }
angle_rad = { start = "measured_rad" }
speed_rad_s = { start = "slope(measured_rad)" }
[parameters]
resistance_ohm = { nominal = 2.2, min = 0.1, max = 20.0 }
inductance_H = { nominal = 0.02, frozen = true }
constant_V_s = { nominal = 0.055, min = 0.001, max = 1.0 }
damping_N_m_s = { nominal = 1e-5, min = 0.0, max = 1e-3 }
inertia_kg_m2 = { nominal = 3e-4, frozen = true }
[rates]
current_A = "(voltage_V - resistance_ohm * current_A - constant_V_s * speed_rad_s) / inductance_H"
angle_rad = "speed_rad_s"
speed_rad_s = "(constant_V_s * current_A - damping_N_m_s * speed_rad_s) / inertia_kg_m2"
[outputs]
measured_A = { value = "current_A", sd = "estimate" }
measured_rad = { value = "angle_rad", sd = "estimate" }
""",
    function=motor,
    arguments={
        "states": ["current_A", "angle_rad", "speed_rad_s"],
        "inputs": {"voltage_V": "zero"},
        "parameters": {
            "resistance_ohm": (2.2, 0.1, 20.0),
            "inductance_H": {"nominal": 0.02, "frozen": True},
            "constant_V_s": (0.055, 0.001, 1.0),
            "damping_N_m_s": (1e-5, 0.0, 1e-3),
            "inertia_kg_m2": {"nominal": 3e-4, "frozen": True},
        },
        "outputs": {"measured_A": "current_A", "measured_rad": "angle_rad"},
    },
    truth=_true_motor,
    outputs={"measured_A": 0, "measured_rad": 1},
    inputs={"voltage_V": lambda t: np.round(4.0 * np.sin(3.0 * t) + 3.0 * np.sin(8.0 * t), 1)},
    starts=((0.0, 0.0, 0.0), (0.2, 0.5, 20.0), (-0.1, 0.2, -30.0)),
    noise=0.02,
)

_ARM_TEXT = """
scenario = "system"
name = "arm"
[inputs]
torque1_N_m = { hold = "zero" }
torque2_N_m = { hold = "zero" }
[states]
q1_rad = { start = "angle1_rad" }
q2_rad = { start = "angle2_rad" }
w1_rad_s = { start = "slope(angle1_rad)" }
w2_rad_s = { start = "slope(angle2_rad)" }
[parameters]
mass1_kg = { nominal = 1.1, min = 0.1, max = 10.0 }
mass2_kg = { nominal = 0.75, min = 0.1, max = 10.0 }
[rates]
q1_rad = "w1_rad_s"
q2_rad = "w2_rad_s"
w1_rad_s = "(M22 * R1 - M12 * R2) / (M11 * M22 - M12 * M12)"
w2_rad_s = "(M11 * R2 - M12 * R1) / (M11 * M22 - M12 * M12)"
[outputs]
angle1_rad = { value = "q1_rad", sd = "estimate" }
angle2_rad = { value = "q2_rad", sd = "estimate" }
"""
_ARM_TERMS = {
    "M11": "(mass1_kg * (0.16 / 12 + 0.04) + mass2_kg * (0.09 / 12 + 0.16 + 0.0225) + 0.12 * mass2_kg * cos(q2_rad))",
    "M12": "(mass2_kg * (0.09 / 12 + 0.0225) + 0.06 * mass2_kg * cos(q2_rad))",
    "M22": "(mass2_kg * (0.09 / 12 + 0.0225))",
    "R1": "(torque1_N_m + 0.06 * mass2_kg * sin(q2_rad) * (2 * w1_rad_s * w2_rad_s + w2_rad_s^2)"
    " - (0.2 * mass1_kg + 0.4 * mass2_kg) * 9.81 * sin(q1_rad) - 0.15 * mass2_kg * 9.81 * sin(q1_rad + q2_rad))",
    "R2": "(torque2_N_m - 0.06 * mass2_kg * sin(q2_rad) * w1_rad_s^2 - 0.15 * mass2_kg * 9.81 * sin(q1_rad + q2_rad))",
}
for _name, _formula in _ARM_TERMS.items():
    _ARM_TEXT = _ARM_TEXT.replace(_name, _formula)

ARM = System(
    text=_ARM_TEXT,
    function=arm,
    arguments={
        "states": ["q1_rad", "q2_rad", "w1_rad_s", "w2_rad_s"],
        "inputs": {"torque1_N_m": "zero", "torque2_N_m": "zero"},
        "parameters": {"mass1_kg": (1.1, 0.1, 10.0), "mass2_kg": (0.75, 0.1, 10.0)},
        "outputs": {"angle1_rad": "q1_rad", "angle2_rad": "q2_rad"},
    },
    truth=_true_arm,
    outputs={"angle1_rad": 0, "angle2_rad": 1},
    inputs={
        "torque1_N_m": lambda t: np.round(2.0 * np.sin(2.0 * t) + 1.0 * np.sin(5.0 * t), 2),
        "torque2_N_m": lambda t: np.round(0.5 * np.sin(3.0 * t + 1.0), 2),
    },
    starts=((0.5, -0.3, 0.0, 0.0), (-0.4, 0.6, 0.0, 0.0), (0.2, 0.1, 1.0, -1.0)),
)

ALL = {"pendulum": PENDULUM, "motor": MOTOR, "arm": ARM}

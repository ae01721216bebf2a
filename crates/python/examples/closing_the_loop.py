# %% [markdown]
# # Closing the loop on thrown balls
#
# A model file declares gravity and an impact with constant restitution. The measured throws have something else in them. `discover`
# says what, with the error before and after on throws that no fit has seen.

# %%
from pathlib import Path

import numpy as np
import pandas

import augsim

HERE = Path(globals().get("__file__", "crates/python/examples/notebook")).resolve().parent
SEALED = next(p / "fixtures" / "sealed" for p in [HERE, *HERE.parents] if (p / "fixtures" / "sealed").is_dir())

frame = pandas.read_csv(SEALED / "bounces.csv")
frame.head()

# %% [markdown]
# The frame has a row for each sample; names of columns end in their unit.

# %%
found = augsim.discover(SEALED / "model.toml", frame)
found

# %%
print(found.sentence)
for effect in found.effects:
    for name, estimate in effect["parameters"].items():
        low, high = estimate["ci95"]
        print(f"{effect['kind']}: {name} = {estimate['value']:.4f} {estimate['unit']} [{low:.4f}, {high:.4f}]")

# %% [markdown]
# The augmented model is a model like any other. Each throw is forecast as in the report: its start is fitted to the part before the
# first impact (Gauss and Newton, with all slopes from one call of `simulate`), and the rest is foretold.

# %%
STATES = ["x_m", "z_m", "velocity_x_m_s", "velocity_z_m_s"]
STEP = 1e-4


def simulated(model, states, throw, count, samples=0):
    """Positions `[batch, sample, time, column]` at the first `count` times, from states `[batch, state]`."""
    start = dict(zip(STATES, np.atleast_2d(states).T)) | {"spin_rad_s": throw["spin_rad_s"][0]}
    return model.simulate(start, throw["t_s"][:count], samples=samples)


def fitted_start(model, throw, measured, count):
    """State at the first sample that fits the first `count` samples best."""
    (vx, x), (half_az, vz, z) = (np.polyfit(throw["t_s"][:count] - throw["t_s"][0], m, d) for m, d in zip(measured[:count].T, (1, 2)))
    state = np.array([x, z, vx, vz])
    for _ in range(5):
        paths = simulated(model, np.vstack([state, state + STEP * np.eye(4)]), throw, count)[:, 0]
        slopes = ((paths[1:] - paths[0]) / STEP).reshape(4, -1).T
        state += np.linalg.lstsq(slopes, (measured[:count] - paths[0]).ravel(), rcond=None)[0]
    return state


models = {"declared": augsim.Model(SEALED / "model.toml"), "augmented": found.model}
errors = {name: [] for name in models}
for throw in augsim.read(frame):
    measured = np.column_stack([throw["x_m"], throw["z_m"]])
    impacts = np.flatnonzero(np.diff(throw["z_m"], n=2) > 0.03)
    if len(impacts) == 0 or impacts[0] < 8:
        continue
    for name, model in models.items():
        state = fitted_start(model, throw, measured, impacts[0])
        path = simulated(model, state, throw, None)[0, 0]
        errors[name].append(1e3 * np.sqrt(np.mean((path - measured)[impacts[0] :] ** 2)))
for name, each in errors.items():
    print(f"{name}: {np.median(each):.1f} mm, the median of {len(each)} throws")

# %% [markdown]
# Samples draw what is not known: parameters within their intervals, and the sensor's noise.

# %%
samples = simulated(found.model, state, throw, None, samples=200)
low, high = np.quantile(samples[0], [0.05, 0.95], axis=0)
print(f"90 % band of the height at the end: {1e3 * (high - low)[-1, 1]:.1f} mm wide")

# %% [markdown]
# The report is one page that needs nothing else; a notebook shows its figures.

# %%
found.plot()[:2]

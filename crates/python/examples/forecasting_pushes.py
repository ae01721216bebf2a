# %% [markdown]
# # Forecasting pushes with bands
#
# A rod pushes a block over a table. The declared model (ellipsoidal limit surface, one friction everywhere) does not know the friction
# map of each push, nor inertia. Hybrid+ corrects its roll-out by a net and says how sure it is.

# %%
import os

import numpy as np

import augsim
from augsim import generate

QUICK = bool(os.environ.get("AUGSIM_EXAMPLES_QUICK"))
PUSHES, ITERATIONS, SAMPLES = (60, 60, 20) if QUICK else (1000, 3000, 100)

train, declared = generate.pushes(PUSHES, seed=1)
test, _ = generate.pushes(PUSHES // 4, seed=2)
train, declared

# %%
run = augsim.train(train, "hybrid-plus", declared, iterations=ITERATIONS, seed=1)
run

# %% [markdown]
# `predict` forecasts every push from its first pose and the rod's path: mean, median, 50 and 90 % bands of each column. Only the first
# pose is measured; the rest of the test push is compared with, not seen.

# %%
bands = list(run.predict(test, samples=SAMPLES))
measured = {push["trajectory"]: push for push in test}
position_mm, inside = [], []
for band in bands:
    push = measured[band["trajectory"]]
    at = np.searchsorted(push["t_s"], band["t_s"] - 1e-9)
    off = np.hypot(push["x_m"][at] - band["mean_x_m"], push["y_m"][at] - band["mean_y_m"])
    position_mm.append(1e3 * off.mean())
    inside.append(np.mean((push["x_m"][at] >= band["q05_x_m"]) & (push["x_m"][at] <= band["q95_x_m"])))
print(f"Hybrid+: {np.mean(position_mm):.2f} mm from the measured position, {100 * np.mean(inside):.0f} % within the 90 % band of x")

# %% [markdown]
# The declared physics alone, on the same pushes:

# %%
physics_mm = []
for band in bands:
    push = measured[band["trajectory"]]
    rod = {name: push[name] for name in ("pusher_x_m", "pusher_y_m")}
    start = {name: push[name][0] for name in ("x_m", "y_m", "theta_rad")}
    path = declared.simulate(start, push["t_s"], rod)[0, 0]
    at = np.searchsorted(push["t_s"], band["t_s"] - 1e-9)
    physics_mm.append(1e3 * np.hypot(push["x_m"] - path[:, 0], push["y_m"] - path[:, 1])[at].mean())
print(f"declared physics: {np.mean(physics_mm):.2f} mm")

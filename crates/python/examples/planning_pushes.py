# %% [markdown]
# # Pushing a block to a goal
#
# A rod pushes a square block by straight pushes to a goal pose. Each push is chosen by model-predictive control: of many candidates,
# and as many near the best of these, the one whose forecast ends nearest to the goal is made, then the block is looked at again. The
# world is the virtual laboratory: a friction map of its own for every push, friction that depends on the direction, summed over the
# footprint, another contact friction than declared, and inertia; none of it is declared. The planner forecasts with the calibrated
# analytical model, or with Hybrid+ on top of the declared one.

# %%
import os

import numpy as np

import augsim
from augsim import generate

QUICK = bool(os.environ.get("AUGSIM_EXAMPLES_QUICK"))
TRAIN, ITERATIONS, GOALS, CANDIDATES, SAMPLES = (60, 60, 2, 20, 2) if QUICK else (800, 3000, 100, 100, 8)
#: Most pushes of an episode, and the cost (m) below which a goal is reached.
PUSHES, REACHED = 6, 0.005
#: Half a side of the block and the rod's radius, m; weight of a radian in metres.
HALF, ROD, RADIAN = 0.045, 0.00475, 0.045
MOVING, RESTING, REST_S = 20, 6, 0.3
#: Supports with their mean friction, which is known; "pu" has the most uneven map.
SUPPORTS = {"abs": 0.14, "delrin": 0.14, "plywood": 0.26, "pu": 0.285}
SURFACE = os.environ.get("AUGSIM_SURFACE", "pu")

DECLARED = """
scenario = "push"
object = "rect1"
[parameters]
contact_friction = {{ nominal = {friction}, min = 0.05, max = 1.0 }}
c_m = {{ nominal = {c}, min = 0.01, max = 0.1 }}
support_friction = {support}
"""


def model_of(friction, c):
    """The analytical model with these values."""
    return augsim.Model(DECLARED.format(friction=friction, c=c, support=SUPPORTS[SURFACE]))


declared = model_of(0.25, 0.0344)
world = generate.Laboratory(SURFACE, "rect1", seed=1)


# %% [markdown]
# A push is a side of the block, a place on it, an angle, a length and a speed. Its path is sampled while the rod moves and while it
# rests after it, when a fast block coasts.


# %%
def drawn_pushes(random, count):
    """Pushes `[count, 5]`: side, place along it (m), angle (rad), length (m), speed (m/s)."""
    return np.column_stack(
        [
            random.integers(0, 4, count),
            random.uniform(-0.03, 0.03, count),
            random.uniform(-0.5, 0.5, count),
            random.uniform(0.01, 0.06, count),
            random.uniform(0.05, 0.2, count),
        ]
    )


def near(random, best, count):
    """Pushes `[count, 5]` near the best ones: the same sides, the rest moved a little, within the bounds of drawn ones."""
    moved = np.repeat(best, count // len(best), axis=0)
    moved[:, 1:] += random.normal(size=moved[:, 1:].shape) * [0.004, 0.06, 0.005, 0.02]
    moved[:, 1:] = np.clip(moved[:, 1:], [-0.03, -0.5, 0.01, 0.05], [0.03, 0.5, 0.06, 0.2])
    return moved


def rod_path(pose, push):
    """Times `[T]` and positions of the rod `[T, 2]` for a push of a block at `pose`."""
    side, place, angle, length, speed = push
    turn = pose[2] + side * np.pi / 2
    normal, along = np.array([np.cos(turn), np.sin(turn)]), np.array([-np.sin(turn), np.cos(turn)])
    begin = pose[:2] + (HALF + ROD + 0.001) * normal + place * along
    direction = -np.cos(angle) * normal + np.sin(angle) * along
    far = np.r_[np.linspace(0.0, length, MOVING), np.full(RESTING, length)]
    times = np.r_[np.linspace(0.0, length / speed, MOVING), length / speed + REST_S * np.arange(1, RESTING + 1) / RESTING]
    return times, begin + far[:, None] * direction


def pushed_in_world(pose, push, number):
    """True poses `[T, 3]` of the block under a push; `number` says which friction map it meets."""
    times, rod = rod_path(pose, push)
    return world.pushed(pose, times, rod, number)


def pushed(model, pose, push):
    """Poses `[T, 3]` of the block under a push, by a model."""
    times, rod = rod_path(pose, push)
    start = dict(zip(("x_m", "y_m", "theta_rad"), pose))
    return model.simulate(start, times, {"pusher_x_m": rod[:, 0], "pusher_y_m": rod[:, 1]})[0, 0]


# %% [markdown]
# Measured pushes to learn from (0.3 mm and 0.1 degrees of sensor noise), and the calibration of the analytical model: Gauss and Newton
# over its two parameters, on where the pushes end.

# %%
random = np.random.default_rng(1)
NOISE = np.array([3e-4, 3e-4, np.radians(0.1)])
table = {name: [] for name in ("trajectory", "t_s", "pusher_x_m", "pusher_y_m", "x_m", "y_m", "theta_rad")}
measured = []
for number, push in enumerate(drawn_pushes(random, TRAIN)):
    pose = np.array([0.35, -0.03, random.uniform(-np.pi, np.pi)])
    times, rod = rod_path(pose, push)
    poses = pushed_in_world(pose, push, number) + NOISE * random.normal(size=(len(times), 3))
    measured.append((pose, push, poses[-1]))
    columns = [np.full(len(times), number), times, *rod.T, *poses.T]
    for name, values in zip(table, columns):
        table[name].extend(values)

values, step = np.array([0.25, 0.0344]), np.array([1e-4, 1e-5])
for _ in range(3):
    shifted = [model_of(f, c) for f, c in values + np.vstack([np.zeros(2), np.diag(step)])]
    ends = np.array([[pushed(m, pose, push)[-1] for pose, push, _ in measured[:200]] for m in shifted]) * [1, 1, RADIAN]
    truth = np.array([end for _, _, end in measured[:200]]) * [1, 1, RADIAN]
    slopes = ((ends[1:] - ends[0]) / step[:, None, None]).reshape(2, -1).T
    off = (truth - ends[0]).ravel()
    weight = 1.0 / np.sqrt(1.0 + (off / 0.002) ** 2)
    change = np.linalg.lstsq(slopes * weight[:, None], off * weight, rcond=None)[0]
    values = np.clip(values + change, [0.06, 0.012], [0.9, 0.09])
calibrated = model_of(*values)
print(f"calibrated: contact friction {values[0]:.3f}, c = {1e3 * values[1]:.1f} mm")

# %%
run = augsim.train(table, "hybrid-plus", declared, iterations=ITERATIONS, seed=1)
run

# %% [markdown]
# Two forecasters of where candidates end: one pose each.


# %%
def by_physics(pose, candidates):
    """End poses `[candidate, 3]` by the calibrated model."""
    return np.array([pushed(calibrated, pose, push)[-1] for push in candidates])


def by_net(pose, candidates):
    """End poses by Hybrid+: the median of some samples, all candidates at once."""
    paths = [rod_path(pose, push) for push in candidates]
    actions = np.array([np.column_stack([rod, times]) for times, rod in paths])
    made = run.sample(np.repeat(pose[None], len(candidates), axis=0), actions, SAMPLES)
    return np.median(made[:, :, -1], axis=1)


def cost(poses, goal):
    """Distance to a goal, m, a radian counting as half a side."""
    turned = (poses[..., 2] - goal[2] + np.pi) % (2 * np.pi) - np.pi
    return np.hypot(poses[..., 0] - goal[0], poses[..., 1] - goal[1]) + RADIAN * np.abs(turned)


def episode(forecast, number):
    """Cost at the end of an episode. World, goals and candidates are the same for every forecaster."""
    random = np.random.default_rng([12, number])
    pose, goal = np.array([0.35, -0.03, 0.0]), np.array([0.35, -0.03, random.uniform(-0.6, 0.6)])
    goal[:2] += random.uniform(0.04, 0.1) * np.array([np.cos(a := random.uniform(-np.pi, np.pi)), np.sin(a)])
    for turn in range(PUSHES):
        draws = np.random.default_rng([13, number, turn])
        noise = NOISE * np.random.default_rng([15, number, turn]).normal(size=3)
        candidates = drawn_pushes(draws, CANDIDATES)
        foreseen = cost(forecast(pose + noise, candidates), goal)
        finer = near(draws, candidates[np.argsort(foreseen)[:5]], CANDIDATES)
        candidates = np.vstack([candidates, finer])
        foreseen = np.r_[foreseen, cost(forecast(pose + noise, finer), goal)]
        if foreseen.min() >= cost(pose + noise, goal):
            break
        # Numbers beyond those of the training pushes: maps that nobody has seen, the same for every forecaster.
        pose = pushed_in_world(pose, candidates[foreseen.argmin()], 1_000_000 + number * PUSHES + turn)[-1]
        if cost(pose, goal) < REACHED:
            break
    return cost(pose, goal)


costs = {name: np.array([episode(forecast, n) for n in range(GOALS)]) for name, forecast in [("calibrated physics", by_physics), ("Hybrid+", by_net)]}

# %%
draws = np.random.default_rng(6).integers(0, GOALS, (2000, GOALS))


def interval(values):
    """Mean with its 95 % interval by bootstrap over goals."""
    low, high = np.quantile(values[draws].mean(axis=1), [0.025, 0.975])
    return f"{values.mean():.2f} [{low:.2f}, {high:.2f}]"


for name, each in costs.items():
    print(f"{name}: {interval(1e3 * each)} mm from the goal, reached in {interval(100.0 * (each < REACHED))} % of {GOALS}")
print(f"difference: {interval(1e3 * (costs['calibrated physics'] - costs['Hybrid+']))} mm")

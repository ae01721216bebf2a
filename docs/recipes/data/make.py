"""Writes the recordings of the recipes: an integrator of its own (RK4, 1 ms), noise of a fixed seed."""
import math
import random

def record(rates, start, samples, step_s, noise, rng):
    state, rows, fine = list(start), [], 1e-3
    for k in range(samples):
        rows.append((k * step_s, state[0] + rng.gauss(0, noise)))
        for _ in range(round(step_s / fine)):
            add = lambda a, b, s: [x + s * y for x, y in zip(a, b)]
            k1 = rates(state)
            k2 = rates(add(state, k1, fine / 2))
            k3 = rates(add(state, k2, fine / 2))
            k4 = rates(add(state, k3, fine))
            state = [s + fine / 6 * (a + 2 * b + 2 * c + d) for s, a, b, c, d in zip(state, k1, k2, k3, k4)]
    return rows

def write(path, column, digits, records):
    with open(path, "w") as file:
        file.write(f"trajectory,t_s,{column}\n")
        for name, rows in enumerate(records, 1):
            for t, value in rows:
                file.write(f"{name},{t:.3f},{value:.{digits}f}\n")

rng = random.Random(7)
# A steel blade that bends: 60 1/s² of stiffness, 0.4 1/s of damping, and a stiffness that grows, 9000 1/(m² s²).
blade = lambda s: [s[1], -60 * s[0] - 0.4 * s[1] - 9000 * s[0] ** 3]
starts = [0.03, 0.045, 0.06, 0.075, 0.09, 0.1]
write("blade.csv", "tip_m", 5, [record(blade, [x, 0], 120, 0.02, 4e-4, rng) for x in starts])
# A pendulum of 0.3 m over a magnet: an attraction of 12 1/s² within about 0.15 rad of the lowest point.
magnet = lambda s: [s[1], -9.81 / 0.3 * math.sin(s[0]) - 0.2 * s[1] - 12 * s[0] * math.exp(-((s[0] / 0.15) ** 2))]
starts = [0.05 * i for i in range(1, 13)]
write("swings.csv", "angle_rad", 4, [record(magnet, [x, 0], 120, 0.025, 1.5e-3, rng) for x in starts])

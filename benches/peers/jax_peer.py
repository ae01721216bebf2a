"""JAX's side of the comparison: the same net and loss as `torch_peer.py`, `jit`, `lax.scan` over time with the
input products of all steps taken beforehand, float32.

Usage: jax_peer.py CASE THREADS, then a number of calls a line on standard input; see `compare.py`.
"""
import os
import sys

CASE, THREADS = sys.argv[1], int(sys.argv[2])
os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:THREADS])
if THREADS == 1:
    os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false"

import jax
import jax.numpy as jnp

from serve import serve

HIDDEN = 16
STATE, CONDITION, LATENT = 2, 4, 4


def init():
    keys = iter(jax.random.split(jax.random.PRNGKey(1), 100))
    uniform = lambda shape, n: jax.random.uniform(next(keys), shape, minval=-(n**-0.5), maxval=n**-0.5)
    linear = lambda i, o: {"w": uniform((i, o), i), "b": uniform((o,), i)}

    def recurrent(inputs, outputs):
        layers = [
            {"x": linear(n, 3 * HIDDEN), "h": linear(HIDDEN, 3 * HIDDEN)} for n in (inputs, HIDDEN)
        ]
        return {"layers": layers, "mean": linear(HIDDEN, outputs), "std": linear(HIDDEN, outputs)}

    return {
        "encoder": recurrent(STATE + CONDITION + LATENT, LATENT),
        "prior": recurrent(CONDITION + LATENT, LATENT),
        "decoder": recurrent(LATENT, STATE),
    }


def affine(p, x):
    return x @ p["w"] + p["b"]


def cell(p, h, a):
    c = affine(p["h"], h)
    (a_r, a_z, a_n), (c_r, c_z, c_n) = jnp.split(a, 3, -1), jnp.split(c, 3, -1)
    r, z = jax.nn.sigmoid(a_r + c_r), jax.nn.sigmoid(a_z + c_z)
    n = jnp.tanh(a_n + r * c_n)
    return (1 - z) * n + z * h


def grus(p, x):
    """x [time, batch, feature]"""
    for layer in p["layers"]:

        def step(h, a):
            h = cell(layer, h, a)
            return h, h

        _, x = jax.lax.scan(step, jnp.zeros((x.shape[1], HIDDEN)), affine(layer["x"], x))
    return x


def gaussian(p, x):
    h = grus(p, x)
    return affine(p["mean"], h), jax.nn.softplus(affine(p["std"], h))


def loss(p, x, u, eps):
    mean_q, sd_q = gaussian(p["encoder"], jnp.concatenate([x, u, eps], -1))
    mean_p, sd_p = gaussian(p["prior"], jnp.concatenate([u, eps], -1))
    mean_x = affine(p["decoder"]["mean"], grus(p["decoder"], mean_q + eps * sd_q))
    kl = jnp.log(sd_p / sd_q) + (sd_q**2 + (mean_q - mean_p) ** 2) / (2 * sd_p**2) - 0.5
    return (kl.sum() + 0.5 * ((x - mean_x) ** 2).sum()) / x.shape[1]


def normal(seed, time, batch, width):
    return jax.random.normal(jax.random.PRNGKey(seed), (time, batch, width))


def training(batch, time):
    x, u, eps = normal(2, time, batch, STATE), normal(3, time, batch, CONDITION), normal(4, time, batch, LATENT)

    @jax.jit
    def iteration(p, m, v, t):
        g = jax.grad(loss)(p, x, u, eps)
        t = t + 1
        m = jax.tree.map(lambda m, g: 0.9 * m + 0.1 * g, m, g)
        v = jax.tree.map(lambda v, g: 0.999 * v + 0.001 * g * g, v, g)
        move = lambda p, m, v: p - 1e-3 * (m / (1 - 0.9**t)) / (jnp.sqrt(v / (1 - 0.999**t)) + 1e-8)
        return jax.tree.map(move, p, m, v), m, v, t

    p = init()
    zero = jax.tree.map(jnp.zeros_like, p)
    state = [p, zero, zero, jnp.float32(0)]

    def call():
        state[:] = iteration(*state)
        jax.block_until_ready(state)

    return call


def sampling(batch, time):
    p, u = init(), normal(3, time, batch, CONDITION)

    @jax.jit
    def sample(key):
        eps = jax.random.normal(key, (time, batch, LATENT))
        mean, sd = gaussian(p["prior"], jnp.concatenate([u, eps], -1))
        return affine(p["decoder"]["mean"], grus(p["decoder"], mean + eps * sd))

    return lambda: sample(jax.random.PRNGKey(5)).block_until_ready()


def single_step():
    p, u = init(), normal(3, 1, 1, CONDITION)[0]

    @jax.jit
    def step(key, states):
        def through(name, x, states):
            after = []
            for layer, h in zip(p[name]["layers"], states):
                x = cell(layer, h, affine(layer["x"], x))
                after.append(x)
            return x, after

        eps = jax.random.normal(key, (1, LATENT))
        h, prior = through("prior", jnp.concatenate([u, eps], -1), states[0])
        z = affine(p["prior"]["mean"], h) + eps * jax.nn.softplus(affine(p["prior"]["std"], h))
        h, decoder = through("decoder", z, states[1])
        return affine(p["decoder"]["mean"], h), [prior, decoder]

    key, states = jax.random.PRNGKey(5), [[jnp.zeros((1, HIDDEN))] * 2] * 2
    return lambda: jax.block_until_ready(step(key, states))


serve({
    "train_ball": lambda: training(100, 400),
    "sample": lambda: sampling(2000, 400),
    "step": single_step,
}[CASE]())

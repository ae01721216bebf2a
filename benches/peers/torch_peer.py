"""PyTorch's side of the comparison: the DCVRNN of Ajay et al. (2018) with fused `nn.GRU` layers, float32.

Usage: torch_peer.py CASE THREADS, then a number of calls a line on standard input; see `compare.py`.
"""
import os
import sys

CASE, THREADS = sys.argv[1], int(sys.argv[2])
os.environ["OMP_NUM_THREADS"] = os.environ["MKL_NUM_THREADS"] = str(THREADS)

import torch
from torch import nn
from torch.nn import functional as F

from serve import serve

torch.set_num_threads(THREADS)
torch.manual_seed(1)
HIDDEN, LAYERS = 16, 2


class Recurrent(nn.Module):
    """GRU layers with a mean head and, where asked for, one for the standard deviation."""

    def __init__(self, inputs, outputs, deviation):
        super().__init__()
        self.gru = nn.GRU(inputs, HIDDEN, LAYERS, batch_first=True)
        self.mean = nn.Linear(HIDDEN, outputs)
        self.std = nn.Linear(HIDDEN, outputs) if deviation else None

    def forward(self, x, h=None):
        y, h = self.gru(x, h)
        return self.mean(y), F.softplus(self.std(y)) if self.std else None, h


def features(*widths):
    layers = []
    for a, b in zip(widths, widths[1:]):
        layers += [nn.Linear(a, b), nn.Tanh()]
    return nn.Sequential(*layers)


class Dcvrnn(nn.Module):
    def __init__(self, state, condition, latent, with_features):
        super().__init__()
        x, u, z = state, condition, latent
        self.phi_x = self.phi_u = self.phi_z = nn.Identity()
        if with_features:
            self.phi_x, self.phi_u = features(state, 32, 16), features(condition, 32, 16)
            self.phi_z = features(latent, 16)
            x = u = z = 16
        self.encoder = Recurrent(x + u + latent, latent, True)
        self.prior = Recurrent(u + latent, latent, True)
        self.decoder = Recurrent(z, state, False)

    def loss(self, x, u, eps):
        fu = self.phi_u(u)
        mean_q, sd_q, _ = self.encoder(torch.cat([self.phi_x(x), fu, eps], -1))
        mean_p, sd_p, _ = self.prior(torch.cat([fu, eps], -1))
        mean_x, _, _ = self.decoder(self.phi_z(mean_q + eps * sd_q))
        kl = torch.log(sd_p / sd_q) + (sd_q**2 + (mean_q - mean_p) ** 2) / (2 * sd_p**2) - 0.5
        return (kl.sum(-1) + 0.5 * ((x - mean_x) ** 2).sum(-1)).sum(1).mean()

    def advance(self, u, eps, prior=None, decoder=None):
        mean, sd, prior = self.prior(torch.cat([self.phi_u(u), eps], -1), prior)
        mean_x, _, decoder = self.decoder(self.phi_z(mean + eps * sd), decoder)
        return mean_x, prior, decoder


SIZES = {"ball": (2, 4, 4, False), "push": (4, 12, 16, True)}


def training(config, batch, time):
    state, condition, latent, _ = SIZES[config]
    net = Dcvrnn(*SIZES[config])
    x, u, eps = (torch.randn(batch, time, n) for n in (state, condition, latent))
    adam = torch.optim.Adam(net.parameters(), lr=1e-3)

    def iteration():
        adam.zero_grad(set_to_none=True)
        net.loss(x, u, eps).backward()
        adam.step()

    return iteration


def sampling(batch, time):
    net, u = Dcvrnn(*SIZES["ball"]), torch.randn(batch, time, 4)

    @torch.no_grad()
    def sample():
        net.advance(u, torch.randn(batch, time, 4))

    return sample


def single_step():
    net, u = Dcvrnn(*SIZES["ball"]), torch.randn(1, 1, 4)
    states = [torch.zeros(LAYERS, 1, HIDDEN), torch.zeros(LAYERS, 1, HIDDEN)]

    @torch.no_grad()
    def step():
        _, *states[:] = net.advance(u, torch.randn(1, 1, 4), *states)

    return step


serve({
    "train_ball": lambda: training("ball", 100, 400),
    "train_push": lambda: training("push", 100, 300),
    "sample": lambda: sampling(2000, 400),
    "step": single_step,
}[CASE]())

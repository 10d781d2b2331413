"""Fits networks of NeuS's layout to meshes: the networks of `cargo xtask reproduce --only isosurfacing`.

    python3 -m venv VENV && VENV/bin/pip install numpy libigl torch
    VENV/bin/python experiments/neus/train.py spot.obj bunny_7k.off --out target/neus

The supplement takes checkpoints of NeuS that were trained on the DTU data set; these are not public. A network of this script has
the layout of NeuS (8 layers of 256, the input again before the fifth, six octaves, weight normalisation, softplus of 100, geometric
initialisation; Wang et al. 2021) and is fitted to signed distances of a closed mesh, with the eikonal loss, in place of images. So its
field has what isosurfacing meets in such networks: smooth detail, and slopes that are one only nearly.

For each mesh it writes NAME.pth, which `ndf fit` reads, and prints the mean error of distances near the surface. The mesh is
moved into the unit sphere, farthest point at 0.8. Deterministic by --seed on one machine and thread; about five minutes a mesh on
one core. Where there are no meshes, `ndf sample mesh --shape rope -o rope.ply` and its like make some.
"""

import argparse
import math
import time
from pathlib import Path

import igl
import numpy as np
import torch
from torch import nn

OCTAVES = 6
WIDTH = 256
LAYERS = 9
SKIP = 4
INPUTS = 3 + 6 * OCTAVES


class SdfNetwork(nn.Module):
    """The network of distances of NeuS; names of layers are the authors'."""

    def __init__(self, bias=0.5):
        super().__init__()
        widths = [INPUTS] + [WIDTH] * (LAYERS - 1) + [WIDTH + 1]
        for layer in range(LAYERS):
            outputs = widths[layer + 1] - INPUTS if layer + 1 == SKIP else widths[layer + 1]
            linear = nn.Linear(widths[layer], outputs)
            # Geometric initialisation (Atzmon and Lipman 2020): the field of a sphere.
            with torch.no_grad():
                if layer == LAYERS - 1:
                    linear.weight.normal_(math.sqrt(math.pi / widths[layer]), 1e-4)
                    linear.bias.fill_(-bias)
                else:
                    linear.bias.zero_()
                    linear.weight.normal_(0.0, math.sqrt(2.0 / outputs))
                    if layer == 0:
                        linear.weight[:, 3:] = 0.0
                    if layer == SKIP:
                        linear.weight[:, -(INPUTS - 3) :] = 0.0
            setattr(self, f"lin{layer}", nn.utils.weight_norm(linear))

    def forward(self, x):
        waves = [f(2.0**k * x) for k in range(OCTAVES) for f in (torch.sin, torch.cos)]
        start = torch.cat([x, *waves], dim=-1)
        h = start
        for layer in range(LAYERS):
            if layer == SKIP:
                h = torch.cat([h, start], dim=-1) / math.sqrt(2.0)
            h = getattr(self, f"lin{layer}")(h)
            if layer < LAYERS - 1:
                h = nn.functional.softplus(h, beta=100)
        return h[:, :1]


def read(path):
    """A mesh in the unit sphere."""
    vertices, faces = igl.read_triangle_mesh(str(path))[:2]
    vertices, _, _, faces = igl.remove_duplicate_vertices(vertices, faces, 1e-9)
    vertices = vertices - 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
    return 0.8 * vertices / np.linalg.norm(vertices, axis=1).max(), faces


def samples(vertices, faces, count, rng):
    """Points near the surface and in the unit sphere, half and half of the former nearer, with signed distances."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    chosen = rng.choice(len(faces), count, p=areas / areas.sum())
    u, v = rng.random((2, count, 1))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    points = a[chosen] + u * (b - a)[chosen] + v * (c - a)[chosen]
    points += rng.normal(size=points.shape) * rng.choice([0.005, 0.05], (count, 1))
    anywhere = rng.normal(size=(count // 4, 3))
    anywhere *= rng.random((len(anywhere), 1)) ** (1 / 3) / np.linalg.norm(anywhere, axis=1, keepdims=True)
    points = np.concatenate([points, anywhere])
    signed = igl.SIGNED_DISTANCE_TYPE_FAST_WINDING_NUMBER
    distances = igl.signed_distance(points, vertices, faces, signed)[0]
    return torch.tensor(points, dtype=torch.float32), torch.tensor(distances, dtype=torch.float32)[:, None]


def train(path, options):
    torch.manual_seed(options.seed)
    rng = np.random.default_rng(options.seed)
    points, distances = samples(*read(path), options.samples, rng)
    near = options.samples
    network = SdfNetwork()
    optimiser = torch.optim.Adam(network.parameters(), lr=options.rate)
    start = time.time()
    for step in range(options.steps):
        share = step / options.steps
        rate = min(1.0, step / 50) * (0.02 + 0.98 * 0.5 * (1 + math.cos(math.pi * share)))
        for group in optimiser.param_groups:
            group["lr"] = options.rate * rate
        batch = rng.integers(near, size=options.batch)
        far = rng.integers(near, len(points), size=options.batch // 4)
        chosen = torch.from_numpy(np.concatenate([batch, far]))
        loss = (network(points[chosen]) - distances[chosen]).abs().mean()
        if step % 2 == 0:
            places = points[chosen[:: options.eikonal]].requires_grad_()
            slope = torch.autograd.grad(network(places).sum(), places, create_graph=True)[0]
            loss = loss + 0.02 * ((slope.norm(dim=-1) - 1) ** 2).mean()
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        if step % 100 == 0:
            print(f"{path.stem}: step {step}, loss {loss.item():.2e}, {time.time() - start:.0f} s", flush=True)
    with torch.no_grad():
        errors = [(network(p) - d).abs() for p, d in zip(points[:20000].split(4096), distances[:20000].split(4096))]
    print(f"{path.stem}: mean error near the surface {torch.cat(errors).mean():.2e}, {time.time() - start:.0f} s")
    options.out.mkdir(parents=True, exist_ok=True)
    state = {"sdf_network_fine": network.state_dict(), "iter_step": options.steps}
    torch.save(state, options.out / f"{path.stem}.pth")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("meshes", type=Path, nargs="+")
    parser.add_argument("--out", type=Path, default=Path("target/neus"))
    parser.add_argument("--steps", type=int, default=1500)
    parser.add_argument("--batch", type=int, default=1536)
    parser.add_argument("--eikonal", type=int, default=6, help="one of so many points of a batch has the eikonal loss")
    parser.add_argument("--samples", type=int, default=200_000)
    parser.add_argument("--rate", type=float, default=1e-3)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--threads", type=int, default=1)
    options = parser.parse_args()
    torch.set_num_threads(options.threads)
    for mesh in options.meshes:
        train(mesh, options)


main()

"""Trains the network of neural dual contouring on solids made by code, and writes it as a state of PyTorch's.

    python experiments/ndc/train.py --deep --out ndcx-trained-here.pth

The authors trained for days on thousands of CAD models, and their weights are not public with their code. A network of
this script is of the same shape, sees the same distances and has targets made by the same rule (the least squares of tangent
planes at the crossings of a cell's edges), but of far fewer and simpler shapes. Tables name it as trained here.

Needs torch and numpy. Deterministic by --seed on one machine. Two cores take about ten minutes for NDCx.
"""

import argparse
import time

import numpy as np
import torch
from torch import nn

GRID = 32
SEEN = 3
CUT = 2.0
PULL = 0.05


def leaky(x):
    return nn.functional.leaky_relu(x, 0.01)


def dense(layer, x):
    """A convolution over one place, for rows of channels."""
    return nn.functional.linear(x, layer.weight.flatten(1), layer.bias)


def wide(layer, x):
    """A convolution over 3 x 3 x 3 places, for blocks of them with the channels last: on a processor much faster than
    Conv3d is for many small blocks."""
    windows = x.unfold(1, 3, 1).unfold(2, 3, 1).unfold(3, 3, 1)
    return nn.functional.linear(windows.flatten(4), layer.weight.flatten(1), layer.bias)


class Residual(nn.Module):
    def __init__(self, width):
        super().__init__()
        self.conv_1 = nn.Conv3d(width, width, 1)
        self.conv_2 = nn.Conv3d(width, width, 1)

    def forward(self, x):
        return leaky(dense(self.conv_2, leaky(dense(self.conv_1, x))) + x)


class Network(nn.Module):
    """From distances at 7 x 7 x 7 corners to the place of a vertex in its cell. Names of layers are the authors'."""

    def __init__(self, deep, width=64):
        super().__init__()
        self.conv_0 = nn.Conv3d(1, width, 3)
        self.conv_1 = nn.Conv3d(width, width, 3)
        self.conv_2 = nn.Conv3d(width, width, 3)
        if deep:
            for i in range(1, 9):
                setattr(self, f"res_{i}", Residual(width))
        self.blocks = [range(1, 2), range(2, 3), range(3, 9)] if deep else [[], [], []]
        self.conv_3 = nn.Conv3d(width, width, 1)
        self.conv_4 = nn.Conv3d(width, width, 1)
        self.conv_out_float = nn.Conv3d(width, 3, 1)

    def forward(self, patches):
        x = patches[..., None]
        for i in range(3):
            x = leaky(wide(getattr(self, f"conv_{i}"), x))
            for block in self.blocks[i]:
                x = getattr(self, f"res_{block}")(x)
        x = leaky(dense(self.conv_4, leaky(dense(self.conv_3, x))))
        return dense(self.conv_out_float, x)[:, 0, 0, 0]


def rotation(rng):
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    return q * np.sign(np.diag(r))


def part(rng):
    """A ball, box, cylinder or torus anywhere, as a function of points."""
    turn, center = rotation(rng), rng.uniform(-0.4, 0.4, 3)
    size, kind = rng.uniform(0.15, 0.55, 3), rng.integers(4)

    def distance(p):
        p = (p - center) @ turn
        if kind == 0:
            return np.linalg.norm(p, axis=-1) - size[0]
        if kind == 1:
            q = np.abs(p) - size
            return np.linalg.norm(np.maximum(q, 0), axis=-1) + np.minimum(q.max(-1), 0)
        across = np.hypot(p[..., 0], p[..., 1])
        if kind == 2:
            q = np.stack([across - size[0], np.abs(p[..., 2]) - size[1]], -1)
            return np.linalg.norm(np.maximum(q, 0), axis=-1) + np.minimum(q.max(-1), 0)
        return np.hypot(across - size[0], p[..., 2]) - 0.5 * size[1]

    return distance


def solid(rng):
    """A few parts, united, intersected or cut, or hollowed to a shell now and then."""
    parts = [part(rng) for _ in range(rng.integers(1, 5))]
    ways = rng.integers(3, size=len(parts))
    shell = rng.uniform(0.04, 0.12) if rng.random() < 0.2 else None

    def distance(p):
        d = parts[0](p)
        for other, way in zip(parts[1:], ways[1:]):
            e = other(p)
            d = np.minimum(d, e) if way == 0 else np.maximum(d, e if way == 1 else -e)
        return d if shell is None else np.abs(d) - shell

    return distance


def samples(rng, most):
    """Distances around crossed cells of a solid, and where their vertices should be."""
    distance, cell = solid(rng), 2.4 / GRID
    side = np.arange(GRID + 1 + 2 * SEEN) - SEEN
    shift = rng.uniform(-0.5, 0.5, 3)
    corner = lambda index: -1.2 + cell * (index + shift)
    grid = np.stack(np.meshgrid(side, side, side, indexing="ij"), -1)
    values = (distance(corner(grid)) / cell).astype(np.float32)
    inner = values[SEEN:-SEEN, SEEN:-SEEN, SEEN:-SEEN] < 0
    count = sum(
        inner[i : GRID + i, j : GRID + j, k : GRID + k].astype(int) for i in (0, 1) for j in (0, 1) for k in (0, 1)
    )
    cells = np.argwhere((count > 0) & (count < 8))
    if len(cells) == 0:
        return None
    cells = cells[rng.permutation(len(cells))[:most]]
    matrix = np.zeros((len(cells), 3, 3))
    right = np.zeros((len(cells), 3))
    points, normals, crossed = [], [], []
    for axis in range(3):
        for a in (0, 1):
            for b in (0, 1):
                low = cells.copy()
                low[:, (axis + 1) % 3] += a
                low[:, (axis + 2) % 3] += b
                way = np.eye(3)[axis]
                begins = distance(corner(low)) < 0
                is_crossed = begins != (distance(corner(low + way)) < 0)
                t, span = np.zeros(len(cells)), np.ones(len(cells))
                for _ in range(20):
                    span /= 2
                    same = (distance(corner(low + (t + span)[:, None] * way)) < 0) == begins
                    t += np.where(same, span, 0)
                point = low + (t + span)[:, None] * way
                step = 1e-3
                slope = [
                    distance(corner(point + step * e)) - distance(corner(point - step * e)) for e in np.eye(3)
                ]
                normal = np.stack(slope, -1)
                normal /= np.linalg.norm(normal, axis=-1, keepdims=True) + 1e-12
                points.append(point - cells)
                normals.append(normal)
                crossed.append(is_crossed)
    crossed, points, normals = np.array(crossed, float), np.array(points), np.array(normals)
    mean = (crossed[..., None] * points).sum(0) / crossed.sum(0)[:, None]
    matrix = np.einsum("ec,eci,ecj->cij", crossed, normals, normals) + PULL**2 * np.eye(3)
    along = np.einsum("ec,eci,eci->ec", crossed, normals, points - mean)
    right = np.einsum("ec,eci->ci", along, normals)
    target = np.clip(mean + np.linalg.solve(matrix, right[..., None])[..., 0], 0, 1)
    windows = np.lib.stride_tricks.sliding_window_view(values, (7, 7, 7))
    patches = np.clip(windows[cells[:, 0], cells[:, 1], cells[:, 2]], -CUT, CUT)
    # The surface seen from the other side has its vertices at the same places.
    patches = patches * rng.choice([-1.0, 1.0])
    return patches.astype(np.float32), target.astype(np.float32)


def gathered(rng, wanted):
    patches, targets = [], []
    while sum(map(len, targets)) < wanted:
        found = samples(rng, 400)
        if found is not None:
            patches.append(found[0])
            targets.append(found[1])
    patches, targets = np.concatenate(patches), np.concatenate(targets)
    order = rng.permutation(len(targets))
    return torch.from_numpy(patches[order]), torch.from_numpy(targets[order])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--deep", action="store_true", help="NDCx, with residual blocks, in place of NDC")
    parser.add_argument("--steps", type=int, default=2000)
    parser.add_argument("--samples", type=int, default=100_000, help="cells to learn from")
    parser.add_argument("--batch", type=int, default=256)
    parser.add_argument("--rate", type=float, default=1e-3)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", default="ndc-trained-here.pth")
    settings = parser.parse_args()
    torch.manual_seed(settings.seed)
    rng = np.random.default_rng(settings.seed)
    start = time.time()
    patches, targets = gathered(rng, settings.samples)
    tests, truths = gathered(np.random.default_rng(settings.seed + 1_000_003), 5_000)
    print(f"{len(targets)} cells in {time.time() - start:.0f} s", flush=True)
    network = Network(settings.deep)
    optimiser = torch.optim.Adam(network.parameters(), settings.rate)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, settings.rate, settings.steps)
    for step in range(settings.steps):
        chosen = torch.randint(len(targets), (settings.batch,))
        loss = ((network(patches[chosen]) - targets[chosen]) ** 2).mean()
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        schedule.step()
        if step % 250 == 249:
            with torch.no_grad():
                found = torch.cat([network(t) for t in tests.split(500)]).clamp(0, 1)
                error = ((found - truths) ** 2).mean().sqrt()
                middle = ((0.5 - truths) ** 2).mean().sqrt()
            print(
                f"step {step + 1}: error {error:.4f} cells, that of the middle {middle:.4f}, {time.time() - start:.0f} s",
                flush=True,
            )
    torch.save(network.state_dict(), settings.out)


if __name__ == "__main__":
    main()

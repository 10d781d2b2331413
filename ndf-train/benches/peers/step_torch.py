"""One training step of the paper's size in PyTorch on the CPU: both networks, features gathered and scattered, Adam.

usage: step_torch.py THREADS       prints "NAME MEDIAN_MS LEAST_MS" for each step
"""
import math, statistics, sys, time
import torch
import torch.nn.functional as F

torch.set_num_threads(int(sys.argv[1]))
torch.manual_seed(0)
SAMPLES, VERTICES, FEATURES, OCTAVES = 32768, 2000, 8, 8
positions = torch.rand(VERTICES, 3) * 2 - 1
corners = torch.randint(0, VERTICES, (SAMPLES, 3)).sort(0).values
barycentric = torch.rand(SAMPLES, 3)
barycentric /= barycentric.sum(1, keepdim=True)
x = (positions[corners] * barycentric[:, :, None]).sum(1)
edges = [positions[corners[:, k]] - positions[corners[:, 0]] for k in (1, 2)]
foot = x + 0.05 * torch.randn(SAMPLES, 3)
normal = F.normalize(torch.randn(SAMPLES, 3), dim=1)
frequencies = math.pi * 2.0 ** torch.arange(OCTAVES)


def network(inputs):
    return [p for i, o in ((inputs, 32), (32, 32), (32, 3)) for p in torch.nn.Linear(i, o).parameters()]


def mlp(h, w1, b1, w2, b2, w3, b3):
    h = torch.relu(torch.addmm(b1, h, w1.t()))
    h = torch.relu(torch.addmm(b2, h, w2.t()))
    return torch.addmm(b3, h, w3.t())


def encoded(p):
    a = (p[:, None, :] * frequencies[None, :, None]).reshape(len(p), -1)
    return torch.cat([p, torch.sin(a), torch.cos(a)], 1)


def step(with_tangents, with_normals):
    features = (0.1 * torch.randn(VERTICES, FEATURES)).requires_grad_()
    theta, phi = network(FEATURES + 3), network(3 + 6 * OCTAVES)
    optimiser = torch.optim.Adam([features, *theta, *phi], lr=1e-3, fused=True)

    def g(z, x):
        return x + mlp(torch.cat([z, x], 1), *theta)

    def once():
        optimiser.zero_grad(set_to_none=True)
        of_corners = F.embedding(corners, features)
        z = (of_corners * barycentric[:, :, None]).sum(1)
        y = g(z, x)
        back = y + mlp(encoded(y), *phi)
        loss = 1e4 * ((y - foot) * normal).sum(1).square().mean() + 1e2 * (back - x).square().sum(1).mean()
        if with_tangents:
            directions = [(of_corners[:, k] - of_corners[:, 0], edges[k - 1]) for k in (1, 2)]
            with torch.set_grad_enabled(with_normals):
                u, v = (torch.func.jvp(g, (z, x), d)[1] for d in directions)
                n = F.normalize(torch.linalg.cross(u, v), dim=1)
            if with_normals:
                loss = loss + (n - normal).square().sum(1).mean()
        loss.backward()
        optimiser.step()

    return once


for name, with_tangents, with_normals in (
    ("values", False, False),
    ("values,_tangents", True, False),
    ("values,_tangents,_normals", True, True),
):
    once = step(with_tangents, with_normals)
    for _ in range(3):
        once()
    times = []
    for _ in range(15):
        begin = time.perf_counter()
        once()
        times.append(1e3 * (time.perf_counter() - begin))
    print(name, statistics.median(times), min(times), flush=True)

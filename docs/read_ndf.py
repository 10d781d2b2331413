#!/usr/bin/env python3
"""Reads `.ndf` models as docs/format.md specifies them, by the standard library of Python (3.8 or later) alone.

    read_ndf.py MODEL.ndf                                says what is in the model
    read_ndf.py MODEL.ndf --compare MODEL.safetensors    compares its arrays with those of `ndf convert`, bit for bit
    read_ndf.py MODEL.ndf --evaluate < POINTS            for lines of a base face and three barycentric coordinates,
                                                         the point of the surface in world coordinates and its scalars

As a module, `read(bytes)` gives a `Model`. It is written to be read beside the specification, not to be fast.
"""

import argparse
import functools
import itertools
import json
import math
import struct
import sys
import zlib
from collections import defaultdict


class Damaged(ValueError):
    """The file is not what the specification allows."""


def require(condition, what):
    if not condition:
        raise Damaged(what)


class Bytes:
    """A section's payload, read from its beginning to its end."""

    def __init__(self, data):
        self.data, self.at = data, 0

    def take(self, count):
        require(self.at + count <= len(self.data), "a section ends too early")
        self.at += count
        return self.data[self.at - count : self.at]

    def numbers(self, kind, count):
        """So many numbers of a kind of `struct`."""
        return list(struct.unpack(f"<{count}{kind}", self.take(count * struct.calcsize(kind))))

    def number(self, kind):
        return self.numbers(kind, 1)[0]

    def rest(self):
        return self.take(len(self.data) - self.at)

    def end(self):
        require(self.at == len(self.data), "a section has more bytes than it should")


def finite(numbers):
    require(all(map(math.isfinite, numbers)), "a number is not finite")
    return numbers


# Range coder

TOP = 1 << 24


def states(*shape):
    """Nested lists of decisions' states."""
    return [states(*shape[1:]) for _ in range(shape[0])] if shape else [1 << 23, 0]


class Distribution:
    """What is known of the integers of one kind."""

    def __init__(self):
        self.classes, self.signs, self.mantissas = states(32), states(32), states(32, 8)


class RangeDecoder:
    def __init__(self, data):
        self.data, self.length, self.at = data + bytes(4), len(data), 4
        self.code, self.range = int.from_bytes(self.data[:4], "big"), (1 << 32) - 1

    def normalize(self):
        while self.range < TOP:
            require(self.at < len(self.data), "coded numbers end too early")
            self.range, self.code = self.range << 8, (self.code << 8 | self.data[self.at]) & 0xFFFFFFFF
            self.at += 1

    def decision(self, state):
        zero, seen = state
        split = (self.range >> 16) * min(max(zero >> 8, 32), 65504)
        bit = int(self.code >= split)
        if bit:
            self.code, self.range = self.code - split, self.range - split
            state[0] -= zero // (seen + 2)
        else:
            self.range = split
            state[0] += (TOP - zero) // (seen + 2)
        state[1] = min(seen + 1, 254)
        self.normalize()
        return bit

    def plain_bit(self):
        self.range >>= 1
        bit = int(self.code >= self.range)
        self.code -= bit * self.range
        self.normalize()
        return bit

    def tree(self, bits, array):
        node = 1
        for _ in range(bits):
            node = 2 * node + self.decision(array[node])
        return node - (1 << bits)

    def integer(self, of):
        bits = self.tree(5, of.classes)
        if bits == 0:
            return 0
        negative = self.decision(of.signs[bits])
        modelled = min(bits - 1, 3)
        magnitude = 1 << modelled | self.tree(modelled, of.mantissas[bits])
        for _ in range(bits - 1 - modelled):
            magnitude = 2 * magnitude + self.plain_bit()
        return -magnitude if negative else magnitude

    def end(self, zeros=False):
        """Refuses bytes after the last number; with `zeros`, only those that are not zero."""
        require(self.at >= self.length or zeros and not any(self.data[self.at :]), "coded numbers leave bytes unread")


# Arrays


def array(section, count, group_count, groups, coded):
    """So many numbers, each of the next group of `groups`; `coded`: whether the file says how they are written."""
    way = section.number("B") if coded else 0
    require(way <= 1, "an array is written in an unknown way")
    if way == 0:
        return finite(section.numbers("f", count))
    steps = [2.0**e for e in section.numbers("b", group_count)]
    length = section.number("I")
    require(count <= (1 << 16) + 256 * length, "an array is too long for its bytes")
    coder = RangeDecoder(section.take(length))
    of = [Distribution() for _ in steps]
    numbers = [coder.integer(of[g]) * steps[g] for g in itertools.islice(groups, count)]
    coder.end()
    return numbers


# Base mesh


class Nodes:
    """The nodes of all fronts."""

    def __init__(self):
        self.vertex, self.behind, self.before, self.border = [], [], [], []

    def add(self, vertex):
        self.vertex.append(vertex)
        for values in (self.behind, self.before, self.border):
            values.append(None)
        return len(self.vertex) - 1

    def connect(self, a, b, border=False):
        self.behind[a], self.before[b], self.border[a] = b, a, border

    def walk(self, node, steps):
        require(abs(steps) <= len(self.vertex), "a front is shorter than it should be")
        for _ in range(abs(steps)):
            node = self.behind[node] if steps > 0 else self.before[node]
        return node


def connectivity(coder, vertex_count, face_count):
    nodes, faces, degree = Nodes(), [], []
    kinds = {kind: states(2, 16) for kind in ("new", "ahead", "border", "behind")}
    split_state, offsets, fronts = states(), Distribution(), Distribution()

    def new_node():
        require(len(degree) < vertex_count, "more vertices than there should be")
        degree.append(0)
        return nodes.add(len(degree) - 1)

    def conquer(*corners):
        require(len(faces) < face_count, "more faces than there should be")
        faces.append(tuple(nodes.vertex[n] for n in corners))
        for vertex in faces[-1]:
            degree[vertex] += 1

    def splice(a, b, c):
        """Behind a: c and what was behind it; before b: a new node at c's vertex and what was before c."""
        twin, before = nodes.add(nodes.vertex[c]), nodes.before[c]
        nodes.connect(before, twin, nodes.border[before])
        nodes.connect(twin, b)
        nodes.connect(a, c)

    def gate(pivot):
        """The gate at the pivot or the first node behind it that has one: the pivot, a, b; nothing if none has."""
        first = pivot
        while True:
            before, behind = nodes.before[pivot], nodes.behind[pivot]
            if not nodes.border[before]:
                return pivot, before, pivot
            if not nodes.border[pivot]:
                return pivot, pivot, behind
            pivot = behind
            if pivot == first:
                return None

    while len(faces) < face_count:
        corners = [new_node() for _ in range(3)]
        conquer(*corners)
        for i in range(3):
            nodes.connect(corners[i - 1], corners[i])
        stack = corners[:1]
        while stack:
            pivot = stack.pop()
            while found := gate(pivot):
                pivot, a, b = found
                leads, around = int(b == pivot), min(degree[nodes.vertex[pivot]], 15)
                kind = next((k for k, s in kinds.items() if coder.decision(s[leads][around])), None)
                if kind is None:
                    kind = "split" if coder.decision(split_state) else "merge"
                if kind == "border":
                    nodes.border[a] = True
                elif kind == "new":
                    c = new_node()
                    conquer(b, a, c)
                    nodes.connect(a, c)
                    nodes.connect(c, b)
                elif kind == "ahead":
                    c = nodes.behind[b]
                    conquer(b, a, c)
                    if nodes.behind[c] == a:
                        break
                    nodes.connect(a, c)
                    pivot = c if pivot == b else pivot
                elif kind == "behind":
                    c = nodes.before[a]
                    conquer(b, a, c)
                    nodes.connect(c, b)
                    pivot = c if pivot == a else pivot
                elif kind == "split":
                    n = coder.integer(offsets)
                    c = nodes.walk(b if n > 0 else a, n)
                    require(c not in (a, b), "a front meets itself where it does not")
                    conquer(b, a, c)
                    splice(a, b, c)
                    stack.append(a if pivot == b else b)
                else:
                    m, n = coder.integer(fronts), coder.integer(offsets)
                    require(0 <= m < len(stack), "a front that is not there")
                    c = nodes.walk(stack.pop(-1 - m), n)
                    conquer(b, a, c)
                    splice(a, b, c)
    require(len(degree) == vertex_count, "fewer vertices than there should be")
    return faces


def positions(coder, vertex_count, faces, weights=None):
    """Positions in steps of the grid; `weights` of the prediction in way 2."""
    opposite, around = {}, defaultdict(list)
    for i, j, k in faces:
        for v, p, q in ((i, j, k), (j, k, i), (k, i, j)):
            opposite[p, q] = v
            around[v].append((p, q))
    of = [Distribution() for _ in range(3)]
    points = []

    def weighted(guesses, neighbours, opposites):
        """The prediction of way 2."""
        n, m = len(guesses), len(neighbours)
        a, b = weights[:2] if n == 1 else weights[2:]
        for near, far, around in zip(*(map(sum, zip(*x)) for x in (guesses, opposites, neighbours))):
            edges = near + far  # guesses are p + q − o
            total = 16 * m * edges + a * m * (edges - 2 * far) + b * (2 * n * around - m * edges)
            yield (2 * total + 32 * n * m) // (64 * n * m)

    for v in range(vertex_count):
        guesses, opposites = [], []
        for p, q in around[v]:
            o = opposite.get((q, p), v)
            if max(p, q, o) < v:
                guesses.append([x + y - z for x, y, z in zip(points[p], points[q], points[o])])
                opposites.append(points[o])
        neighbours = [points[u] for edge in around[v] for u in edge if u < v]
        if guesses and weights:
            predicted = weighted(guesses, neighbours, opposites)
        else:
            means = guesses or neighbours or points[-1:] or [[0, 0, 0]]
            n = len(means)
            predicted = [(2 * sum(c) + n) // (2 * n) for c in zip(*means)]
        points.append([f + coder.integer(d) for f, d in zip(predicted, of)])
    return points


class BaseMesh:
    """`positions` in the box and `faces`; in way 2 also `control`, the positions in steps of `spacing`."""

    def __init__(self, section, version):
        self.control = None
        way = section.number("B") if version >= 2 else 0
        require(way <= (2 if version >= 3 else 1), "the base mesh is written in an unknown way")
        self.vertex_count, self.face_count = section.numbers("I", 2)
        (self.read_plain, self.read_coded, self.read_control)[way](section)
        section.end()

    def read_positions(self, section):
        self.positions = rows(finite(section.numbers("f", 3 * self.vertex_count)), self.vertex_count, 3)

    def read_plain(self, section):
        self.read_positions(section)
        self.read_faces(section, "H" if self.vertex_count <= 65536 else "I")

    def read_faces(self, section, kind):
        indices = section.numbers(kind, 3 * self.face_count)
        require(all(i < self.vertex_count for i in indices), "a face has a vertex that is not there")
        self.faces = rows(indices, self.face_count, 3)

    def read_connectivity(self, data, most_faces, coded=True):
        """The coder after it, or, where it is not coded, before anything."""
        most_faces = min((1 << 16) + 1024 * len(data), most_faces)
        require(self.face_count <= most_faces, "the base mesh is too large for its bytes")
        coder = RangeDecoder(data)
        if coded:
            self.faces = connectivity(coder, self.vertex_count, self.face_count)
        return coder

    def read_coded(self, section):
        exponent = section.number("b")
        coder = self.read_connectivity(section.take(section.number("I")), 1 << 21)
        if exponent == 127:
            self.read_positions(section)
        else:
            steps = positions(coder, self.vertex_count, self.faces)
            self.positions = [[x * 2.0**exponent for x in p] for p in steps]
        coder.end()

    def read_control(self, section):
        (self.spacing,) = positive(section.numbers("f", 1))
        weights = section.numbers("b", 4)
        coded = section.number("B")
        require(coded <= 1, "connectivity is written in an unknown way")
        if not coded:
            self.read_faces(section, "I")
        coder = self.read_connectivity(section.rest(), 1 << 20, coded)
        self.control = positions(coder, self.vertex_count, self.faces, weights)
        coder.end(zeros=True)
        require(all(abs(x) <= 1 << 24 for x in flat(self.control)), "a position is too large")
        self.positions = [[single(x * self.spacing) for x in p] for p in self.control]


def positive(numbers):
    require(all(x > 0 for x in finite(numbers)), "a number is not positive")
    return numbers


def single(x):
    """Rounded to single precision."""
    require(abs(x) < 2**128 - 2**103, "a position is too large")
    return struct.unpack("f", struct.pack("f", x))[0]


def rows(numbers, count, width):
    return [numbers[i * width : (i + 1) * width] for i in range(count)]


def flat(rows):
    return [x for row in rows for x in row]


# Network

ACTIVATIONS = (
    ("ReLU", lambda x: max(x, 0.0)),
    ("leaky ReLU", lambda x: x if x > 0.0 else 0.01 * x),
    ("SiLU", lambda x: x / (1.0 + math.exp(-x)) if x > -700.0 else 0.0),
    ("sine", math.sin),
    ("tanh", math.tanh),
)


class Network:
    """A perceptron of [z, x, PE(x)] and, with `channel`, of a number that tells which output is meant."""

    def __init__(self, activation, octaves, hidden, features, outputs, channel=False):
        require(activation < len(ACTIVATIONS), "an unknown activation")
        sizes_allowed = features <= 4096 and octaves <= 20 and all(1 <= width <= 4096 for width in hidden)
        require(sizes_allowed and 1 <= outputs <= 4096, "a network is too large")
        self.activation, self.octaves, self.channel = activation, octaves, channel
        self.widths = [features + 3 + 6 * octaves + channel, *hidden, outputs]
        self.shapes = list(zip(self.widths[1:], self.widths))

    def read(self, section, coded):
        sizes = [size for outputs, inputs in self.shapes for size in (outputs * inputs, outputs)]
        groups = itertools.chain.from_iterable(itertools.repeat(g, size) for g, size in enumerate(sizes))
        self.parameters = array(section, sum(sizes), len(sizes), groups, coded)
        self.layers, at = [], 0
        for outputs, inputs in self.shapes:
            middle = at + outputs * inputs
            weights, biases = self.parameters[at:middle], self.parameters[middle : middle + outputs]
            self.layers.append((rows(weights, outputs, inputs), biases))
            at = middle + outputs
        return self

    def __call__(self, z, x, *channel):
        angles = [2.0**o * math.pi * c for o in range(self.octaves) for c in x]
        y = [*z, *x, *map(math.sin, angles), *map(math.cos, angles), *channel]
        for layer, (weights, biases) in enumerate(self.layers):
            y = [b + sum(w * v for w, v in zip(row, y)) for row, b in zip(weights, biases)]
            if layer + 1 < len(self.layers):
                y = list(map(ACTIVATIONS[self.activation][1], y))
        return y


def features(section, vertex_count, width, coded):
    require(width <= 4096, "too many features")
    numbers = array(section, vertex_count * width, width, itertools.cycle(range(width)), coded)
    return rows(numbers, vertex_count, width)


class Channels:
    """Names of scalars, and what their values mean."""

    def __init__(self, section):
        self.names, self.ranges = [], []
        for _ in range(section.number("I")):
            self.names.append(section.take(section.number("B")).decode("ascii"))
            self.ranges.append(section.numbers("f", 4))

    def values(self, outputs):
        pairs = zip(outputs, self.ranges)
        return [min(max(mean + scale * v, low), high) for v, (low, high, mean, scale) in pairs]


class ScalarSet(Channels):
    """Scalars that were learned together by a network."""

    def __init__(self, section, vertex_count):
        super().__init__(section)
        width = section.number("I")
        activation, indexed, octaves, depth = section.numbers("B", 4)
        require(indexed <= 1, "an unknown channel index")
        hidden = section.numbers("I", depth)
        outputs = 1 if indexed else len(self.names)
        self.network = Network(activation, octaves, hidden, width, outputs, bool(indexed)).read(section, True)
        self.features = features(section, vertex_count, width, True)
        section.end()

    def __call__(self, z, x):
        if self.network.channel:
            k = len(self.names)
            y = [self.network(z, x, (2 * i + 1) / k - 1)[0] for i in range(k)]
        else:
            y = self.network(z, x)
        return self.values(y)


# Levels


def weighted_sum(*terms):
    """The sum of weights times points."""
    return [sum(w * p[k] for w, p in terms) for k in range(3)]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return [a[k - 2] * b[k - 1] - a[k - 1] * b[k - 2] for k in range(3)]


class Mesh:
    """Faces and edges: `ends` of edges and vertices `across` them, edges that are `sides` of faces, edges that are
    `creases` and vertices that are `corners`."""

    def __init__(self, vertex_count, faces, creases=(), corners=()):
        self.vertex_count, self.faces = vertex_count, faces
        self.creases, self.corners = set(creases), set(corners)
        self.ends, self.across, self.sides, edges = [], [], [], {}
        for face in faces:
            self.sides.append([])
            for a, b, c in (face, (*face[1:], face[0]), (face[2], *face[:2])):
                edge = edges.setdefault(frozenset((a, b)), len(self.ends))
                if edge == len(self.ends):
                    self.ends.append((a, b))
                    self.across.append([])
                self.across[edge].append(c)
                self.sides[-1].append(edge)
        require(all(len(across) <= 2 for across in self.across), "an edge has more than two faces")
        self.edges_at = [[] for _ in range(vertex_count)]
        for edge, ends in enumerate(self.ends):
            for v in ends:
                self.edges_at[v].append(edge)

    def is_sharp(self, edge):
        return edge in self.creases or len(self.across[edge]) == 1

    def sharp_at(self, v):
        return [e for e in self.edges_at[v] if self.is_sharp(e)]

    @functools.cached_property
    def neighbours(self):
        """Of every vertex its kind, and the neighbours that count."""
        found = []
        for v, edges in enumerate(self.edges_at):
            require(sum(len(self.across[e]) == 1 for e in edges) in (0, 2), "the boundary is no curve")
            sharp = self.sharp_at(v)
            if len(sharp) > 2 or v in self.corners:
                found.append(("corner", []))
            else:
                kind, edges = ("crease", sharp) if len(sharp) == 2 else ("smooth", edges)
                found.append((kind, [sum(self.ends[e]) - v for e in edges]))
        return found

    def split(self):
        faces, middle = [], self.vertex_count
        for (a, b, c), sides in zip(self.faces, self.sides):
            x, y, z = (middle + edge for edge in sides)
            faces += (a, x, z), (x, b, y), (z, y, c), (x, y, z)
        # A vertex of more than two sharp edges stays a corner: it keeps their number.
        finer = Mesh(middle + len(self.ends), faces, (), self.corners)
        halves = {frozenset((v, middle + e)) for e in self.creases for v in self.ends[e]}
        finer.creases = {e for e, ends in enumerate(finer.ends) if frozenset(ends) in halves}
        return finer

    def averages(self, points, smooth, crease):
        """(1 − n w) v + w (sum of n neighbours) with w = smooth(n) or `crease`, with neighbours along it."""
        for v, (kind, around) in zip(points, self.neighbours):
            n = len(around)
            w = smooth(n) if kind == "smooth" else crease
            yield weighted_sum((1 - n * w, v), *((w, points[u]) for u in around))

    def subdivide(self, points):
        """Positions of the vertices of the mesh that is split."""
        new = list(self.averages(points, beta, 1 / 8))
        for edge, ((a, b), across) in enumerate(zip(self.ends, self.across)):
            weights = (1 / 2, 1 / 2) if self.is_sharp(edge) else (3 / 8, 3 / 8, 1 / 8, 1 / 8)
            new.append(weighted_sum(*zip(weights, [points[v] for v in (a, b, *across)])))
        return new

    def limit(self, points):
        return list(self.averages(points, lambda n: 1 / (3 / (8 * beta(n)) + n), 1 / 6))

    def corner_normals(self, points):
        """Of every corner of every face the normal of its side of the creases."""
        normals = self.normals(points)
        found = [[normals[v] for v in face] for face in self.faces]
        at = [[] for _ in points]
        for f, face in enumerate(self.faces):
            for v in face:
                at[v].append(f)
        for v in {v for e in self.creases for v in self.ends[e]}:
            parts = {f: f for f in at[v]}
            for f, g in itertools.combinations(at[v], 2):
                common = set(self.sides[f]) & set(self.sides[g]) & set(self.edges_at[v])
                if any(e not in self.creases for e in common):
                    parts = {h: parts[f] if part == parts[g] else part for h, part in parts.items()}
            for part in set(parts.values()):
                faces = [f for f in at[v] if parts[f] == part]
                normal = Mesh(self.vertex_count, [self.faces[f] for f in faces]).normals(points)[v]
                for f in faces:
                    found[f][self.faces[f].index(v)] = normal
        return found

    def tangent(self, v, points):
        """Along the crease through a vertex; `None` where several meet or one ends."""
        kind, around = self.neighbours[v]
        if kind != "crease":
            return None
        a, b = (points[u] for u in around)
        along = weighted_sum((1, b), (-1, a))
        return [x / (math.hypot(*along) or 1) for x in along]

    def normals(self, points):
        sums = [[0.0, 0.0, 0.0] for _ in points]
        for face in self.faces:
            a, b, c = (points[v] for v in face)
            area = cross(*(weighted_sum((1, p), (-1, a)) for p in (b, c)))
            for v in face:
                sums[v] = weighted_sum((1, sums[v]), (1, area))
        return [[x / (math.hypot(*n) or 1) for x in n] for n in sums]

    def edge_neighbours(self):
        """Of every edge, the other edges of its faces."""
        found = [set() for _ in self.ends]
        for sides in self.sides:
            for edge in sides:
                found[edge].update(other for other in sides if other != edge)
        return found


def beta(n):
    return 3 / 16 if n == 3 else 3 / (8 * n)


THRESHOLDS = (14, 20, 29, 41, 58, 82, 116, 164, 232, 328, 463, 655, 927)


def displacements(coder, mesh, energies, weights):
    """Those in the middles of the edges of a mesh, in steps; `energies` of its vertices."""
    unary, escape, sign = states(len(THRESHOLDS) + 1, 15), states(20), states()
    near = mesh.edge_neighbours()
    steps = []

    def ones(array):
        """The number of decisions that are 1 until one is 0."""
        return next((k for k, state in enumerate(array) if not coder.decision(state)), len(array))

    def activity(i, edges):
        sizes = [min(abs(steps[j]), 15) for j in edges if j < i]
        return 16 * sum(sizes) // max(len(sizes), 1)

    for i, ((a, b), across) in enumerate(zip(mesh.ends, mesh.across)):
        far = set().union(*(near[j] for j in near[i])) - near[i] - {i}
        ends = (energies[a] + energies[b]) // 2
        clues = activity(i, near[i]), activity(i, far), ends, (energies[across[0]] + energies[across[-1]]) // 2, 16
        total = sum(clue * weight for clue, weight in zip(clues, weights))
        magnitude = ones(unary[sum(threshold <= total for threshold in THRESHOLDS)])
        if magnitude == 15:
            bits = 1
            for _ in range(ones(escape)):
                bits = 2 * bits + coder.plain_bit()
            magnitude += bits - 1
        require(magnitude <= 1 << 20, "a displacement is too large")
        steps.append(-magnitude if magnitude and coder.decision(sign) else magnitude)
    return steps


def split_energies(mesh, energies, steps):
    """Energies of the vertices of the mesh that is split."""
    sizes = [min(abs(q), 15) for q in steps]
    old = [16 * sum(sizes[e] for e in edges) // len(edges) + e // 2 for edges, e in zip(mesh.edges_at, energies)]
    return old + [16 * size for size in sizes]


def creases(coder, mesh, flags):
    """Those of a mesh, and corners among its vertices of two sharp edges."""
    sharp, ending, models = set(), [0] * mesh.vertex_count, [states(3) for _ in range(3)]
    for edge, ends in enumerate(mesh.ends if flags & 1 else ()):
        a, b = (min(ending[v], 2) for v in ends)
        if len(mesh.across[edge]) == 2 and coder.decision(models[a][b]):
            sharp.add(edge)
            for v in ends:
                ending[v] += 1
    mesh.creases, corner = sharp, states()
    candidates = [v for v in range(mesh.vertex_count) if len(mesh.sharp_at(v)) == 2] if flags & 2 else ()
    mesh.corners = {v for v in candidates if coder.decision(corner)}


class Levels:
    """Displacements in `steps` on the levels of a Loop surface, and the surface."""

    def __init__(self, section, base):
        self.control, count = base.positions, section.number("B")
        require(count <= 6, "too many levels")
        self.steps = positive(section.numbers("f", count))
        flags = section.number("B")
        require(flags <= 3, "unknown parts of levels")
        weights = rows(section.numbers("B", 5 * count), count, 5)
        data = section.rest()
        self.meshes = [Mesh(base.vertex_count, base.faces)]
        most = min((1 << 19) + 64 * len(data), 1 << 25)
        require(len(self.meshes[0].ends) << 2 * count <= most, "too many displacements for their bytes")
        coder, self.displacements, energies = RangeDecoder(data), [], [0] * base.vertex_count
        creases(coder, self.meshes[0], flags)
        for level_weights in weights:
            mesh = self.meshes[-1]
            self.displacements.append(displacements(coder, mesh, energies, level_weights))
            energies = split_energies(mesh, energies, self.displacements[-1])
            self.meshes.append(mesh.split())
        coder.end(zeros=True)

    @functools.cached_property
    def surface(self):
        """The mesh of the curved triangles, its points and their normals."""
        points = self.control
        for below, mesh, step, level in zip(self.meshes, self.meshes[1:], self.steps, self.displacements):
            points = below.subdivide(points)
            normals = mesh.normals(points)
            for i, q in enumerate(level, below.vertex_count):
                points[i] = weighted_sum((1, points[i]), (step * q, normals[i]))
        mesh = self.meshes[-1].split()
        points = mesh.limit(self.meshes[-1].subdivide(points))
        return mesh, points, mesh.corner_normals(points)

    def evaluate(self, face, bary):
        face, bary = descend(face, bary, len(self.meshes))
        mesh, points, normals = self.surface
        corners, n = mesh.faces[face], normals[face]
        p = [points[v] for v in corners]
        terms = [(b**3, x) for b, x in zip(bary, p)]
        for i, j in itertools.permutations(range(3), 2):
            side = weighted_sum((1, p[j]), (-1, p[i]))
            if mesh.sides[face][i if (i + 1) % 3 == j else j] in mesh.creases:
                t = mesh.tangent(corners[i], points)
                side = [dot(side, t) * x for x in t] if t else side
            else:
                side = weighted_sum((1, side), (-dot(side, n[i]), n[i]))
            middle = weighted_sum((1, p[i]), (1 / 3, side))
            terms.append((3 * bary[i] ** 2 * bary[j] + 6 / 4 * math.prod(bary), middle))
        return weighted_sum(*terms, *((-math.prod(bary), x) for x in p))


def descend(face, bary, splits):
    """The face of the split mesh in which a point lies, and its coordinates there."""
    for _ in range(splits):
        child = next((k for k in range(3) if bary[k] >= 1 / 2), 3)
        if child < 3:
            bary = [2 * b - (k == child) for k, b in enumerate(bary)]
        else:
            bary = [1 - 2 * bary[k - 1] for k in range(3)]
        face = 4 * face + child
    return face, bary


# Scalars on levels


class ScalarLevels(Channels):
    """Scalars on levels of nodes."""

    def __init__(self, section, faces, vertex_count, image):
        """`image(face, bary)` is the field."""
        super().__init__(section)
        self.splits, (self.step,) = section.number("B"), positive(section.numbers("f", 1))
        most = 1 << 16 if self.splits else 1 << 17
        require(self.splits <= 3 and len(faces) << 2 * self.splits <= most, "too many faces for so many splits")
        meshes = [Mesh(vertex_count, faces)]
        for _ in range(self.splits):
            meshes.append(meshes[-1].split())
        self.mesh = meshes[-1]
        self.levels, graphs = self.divide(meshes)
        self.rises = section.numbers("B", len(self.levels))
        data = section.rest()
        count = self.mesh.vertex_count * len(self.names)
        require(count <= (1 << 19) + 1024 * len(data), "too many integers for their bytes")
        self.read_integers(RangeDecoder(data), graphs)
        self.image = image

    @staticmethod
    def divide(meshes):
        """The nodes of the levels, and their graphs as neighbours of nodes."""
        levels, graphs = [], []
        for below, mesh in reversed(list(zip(meshes, meshes[1:]))):
            levels.append(list(range(below.vertex_count, mesh.vertex_count)))
            graphs.append(neighbours(mesh.ends))
        nodes, edges = list(range(meshes[0].vertex_count)), set(map(frozenset, meshes[0].ends))
        while len(nodes) > 24 and len(levels) < len(meshes) + 40:
            graph, taker = neighbours(edges), {}
            for v in nodes:
                if v not in taker:
                    taker[v] = v
                    for u in graph[v]:
                        taker.setdefault(u, v)
            taken = [v for v in nodes if taker[v] != v]
            if not taken:
                break
            levels.append(taken)
            graphs.append(graph)
            nodes = [v for v in nodes if taker[v] == v]
            edges = {edge for edge in (frozenset(taker[v] for v in edge) for edge in edges) if len(edge) == 2}
        levels.append(nodes)
        graphs.append(neighbours(edges))
        return levels[::-1], graphs[::-1]

    def read_integers(self, coder, graphs):
        known, nonzero, of = {}, states(72), [Distribution() for _ in range(72)]
        for finer, (nodes, graph) in zip(reversed(range(len(self.levels))), zip(self.levels, graphs)):
            for v in nodes:
                before = [known[u] for u in graph[v] if u in known]
                known[v] = []
                for k in range(len(self.names)):
                    activity = 4 * sum(min(abs(q[k]), 4096) for q in before) // max(len(before), 1)
                    context = 12 * min(finer, 5) + min(activity.bit_length(), 11)
                    known[v].append(coder.integer(of[context]) if coder.decision(nonzero[context]) else 0)
        coder.end(zeros=True)
        self.integers = [known[v] for nodes in self.levels for v in nodes]

    def positions(self):
        """Images of the nodes."""
        points = {}
        for face in range(len(self.mesh.faces) >> 2 * self.splits):
            corners = [[float(i == j) for j in range(3)] for i in range(3)]
            faces = [corners]
            for _ in range(self.splits):
                split = []
                for a, b, c in faces:
                    x, y, z = ([(p + q) / 2 for p, q in zip(*ends)] for ends in ((a, b), (b, c), (c, a)))
                    split += (a, x, z), (x, b, y), (z, y, c), (x, y, z)
                faces = split
            for i, corners in enumerate(faces, face << 2 * self.splits):
                for v, bary in zip(self.mesh.faces[i], corners):
                    points.setdefault(v, (face, bary))
        return [self.image(*points[v]) for v in range(self.mesh.vertex_count)]

    def energy(self):
        """Q as its rows."""
        points, count = self.positions(), self.mesh.vertex_count
        laplacian, mass = [defaultdict(float) for _ in range(count)], [0.0] * count
        for face in self.mesh.faces:
            for c in range(3):
                v, w = face[c - 2], face[c - 1]
                p, q = (weighted_sum((1, points[u]), (-1, points[face[c]])) for u in (v, w))
                area = math.hypot(*cross(p, q))
                cotangent = min(max(dot(p, q) / area, -1000.0), 1000.0) if area else 0.0
                for a, b in ((v, w), (w, v)):
                    laplacian[a][a] += cotangent
                    laplacian[a][b] -= cotangent
                mass[face[c]] += area
        least = sum(mass) / count / 1000
        rows = [defaultdict(float) for _ in range(count)]
        for row, m in zip(laplacian, mass):
            for v, x in row.items():
                for w, y in row.items():
                    rows[v][w] += x * y / max(m, least)
        return rows

    @functools.cached_property
    def nodes(self):
        """Values of all nodes."""
        rows, values, at = self.energy(), {}, 0
        for level, (nodes, rise) in enumerate(zip(self.levels, self.rises)):
            step = self.step * 2 ** (rise / 8)
            smooth = extension(rows, values) if level else {}
            for v in nodes:
                old = smooth.get(v, [0.0] * len(self.names))
                values[v] = [x + step * q for x, q in zip(old, self.integers[at])]
                at += 1
        return values

    def __call__(self, face, bary):
        face, bary = descend(face, bary, self.splits)
        corners = [self.nodes[v] for v in self.mesh.faces[face]]
        return self.values([dot(bary, x) for x in zip(*corners)])


def neighbours(edges):
    found = defaultdict(set)
    for v, w in edges:
        found[v].add(w)
        found[w].add(v)
    return found


def extension(rows, values):
    """The values of least energy of all other nodes, by elimination in the order of the fewest entries."""
    matrix = {v: {w: x for w, x in row.items() if w not in values} for v, row in enumerate(rows) if v not in values}
    right = {}
    for v in matrix:
        known = [(-x, values[w]) for w, x in rows[v].items() if w in values]
        right[v] = [sum(x * u[k] for x, u in known) for k in range(len(next(iter(values.values()))))]
    eliminated = []
    while matrix:
        v = min(matrix, key=lambda u: len(matrix[u]))
        row = matrix.pop(v)
        pivot = row.pop(v)
        eliminated.append((v, pivot, row))
        for u, x in row.items():
            del matrix[u][v]
            for w, y in row.items():
                matrix[u][w] = matrix[u].get(w, 0.0) - x / pivot * y
            right[u] = [a - x / pivot * b for a, b in zip(right[u], right[v])]
    found = {}
    for v, pivot, row in reversed(eliminated):
        found[v] = [(b - sum(x * found[u][k] for u, x in row.items())) / pivot for k, b in enumerate(right[v])]
    return found


# Model


def read_metric(section):
    """The area of the true surface in the box, and the exponent of distances."""
    require(section.number("B") == 0, "the metric is written in an unknown way")
    area, exponent = finite(section.numbers("f", 2))
    require(area > 0 and 0 <= exponent <= 2, "the metric is out of range")
    section.end()
    return [area, exponent]


class Model:
    """A field on a base mesh: its `positions` in the box and `faces`; `levels`, or `features` of the vertices and a
    `network`; `metric`, if there is one; `scalars`."""

    def __init__(self, version, sections):
        self.version, self.levels = version, None
        # Of sections with the same tag the first counts.
        read = {tag: Bytes(payload) for tag, payload in reversed(sections)}

        def section(tag):
            require(tag in read, f"the section {tag.decode()} is missing")
            return read[tag]

        similarity = section(b"SIML")
        self.scale, *self.centre = finite(similarity.numbers("d", 4))
        require(1e-150 <= self.scale <= 1e150, "the scale of the box is out of range")
        similarity.end()
        self.base = BaseMesh(section(b"BASE"), version)
        self.positions, self.faces = self.base.positions, self.base.faces
        if self.base.control is not None:
            self.levels = Levels(section(b"LEVL"), self.base)
        else:
            self.read_network(section(b"FEAT"), section(b"NETW"))
        self.metric = read_metric(read[b"METR"]) if b"METR" in read else None
        self.provenance = json.loads(read[b"PROV"].data or "{}") if b"PROV" in read else {}
        self.scalars = []
        for tag, data in sections:
            if tag == b"SCAL":
                self.scalars.append(ScalarSet(Bytes(data), len(self.positions)))
            elif tag == b"SLEV" and version >= 3:
                self.scalars.append(ScalarLevels(Bytes(data), self.faces, len(self.positions), self.evaluate))

    def read_network(self, feat, netw):
        coded, width = self.version >= 2, feat.number("I")
        self.features = features(feat, len(self.positions), width, coded)
        activation, self.residual, octaves, depth = netw.numbers("B", 4)
        self.network = Network(activation, octaves, netw.numbers("I", depth), width, 3).read(netw, coded)
        feat.end()
        netw.end()

    def arrays(self):
        """All arrays, named as in the `.safetensors` of `ndf convert`: kind of number as in `struct`, flat numbers."""
        arrays = {
            "similarity": ("d", [self.scale, *self.centre]),
            "base.positions": ("f", flat(self.positions)),
            "base.faces": ("I", flat(self.faces)),
        }
        networks = []
        if self.levels:
            arrays["levels.control"] = ("i", flat(self.base.control))
            arrays["levels.spacing"] = ("f", [self.base.spacing])
            for name, numbers in ("creases", self.levels.meshes[0].creases), ("corners", self.levels.meshes[0].corners):
                arrays[f"levels.{name}"] = ("i", sorted(numbers))
            for level, (step, numbers) in enumerate(zip(self.levels.steps, self.levels.displacements), 1):
                arrays[f"levels.{level}.step"] = ("f", [step])
                arrays[f"levels.{level}.displacements"] = ("i", numbers)
        else:
            arrays["features"] = ("f", flat(self.features))
            networks.append(("network", self.network))
        if self.metric:
            arrays["metric"] = ("f", self.metric)
        for i, scalars in enumerate(self.scalars):
            if isinstance(scalars, ScalarLevels):
                arrays[f"scalars.{i}.integers"] = ("i", flat(scalars.integers))
                arrays[f"scalars.{i}.step"] = ("f", [scalars.step])
                arrays[f"scalars.{i}.rises"] = ("B", scalars.rises)
                continue
            arrays[f"scalars.{i}.features"] = ("f", flat(scalars.features))
            networks.append((f"scalars.{i}.network", scalars.network))
        for name, network in networks:
            for layer, (weights, biases) in enumerate(network.layers):
                arrays[f"{name}.{layer}.weight"] = ("f", flat(weights))
                arrays[f"{name}.{layer}.bias"] = ("f", biases)
        return arrays

    def interpolate(self, values, face, bary):
        return [sum(b * values[i][k] for b, i in zip(bary, self.faces[face])) for k in range(len(values[0]))]

    def evaluate(self, face, bary):
        """The image of a point of the base mesh, in the box."""
        if self.levels:
            return self.levels.evaluate(face, bary)
        x = self.interpolate(self.positions, face, bary)
        y = self.network(self.interpolate(self.features, face, bary), x)
        return [a + b for a, b in zip(x, y)] if self.residual else y

    def world(self, point):
        """A point of the box in the units of the input."""
        return [x / self.scale + c for x, c in zip(point, self.centre)]

    def evaluate_scalars(self, face, bary):
        x, values = self.interpolate(self.positions, face, bary), []
        for s in self.scalars:
            on_levels = isinstance(s, ScalarLevels)
            values += s(face, bary) if on_levels else s(self.interpolate(s.features, face, bary), x)
        return values


def read(data):
    """The model in the bytes of a file."""
    header = Bytes(data)
    require(header.take(8) == b"\x89NDF\r\n\x1a\n", "no .ndf model")
    version, count = header.numbers("I", 2)
    require(1 <= version <= 3, f"version {version} is not known")
    require(count <= 1024, "too many sections")
    table = [struct.unpack("<4sIQ", header.take(16)) for _ in range(count)]
    require(zlib.crc32(data[: header.at]) == header.number("I"), "the checksum of the header does not match")
    sections = []
    for tag, checksum, length in table:
        sections.append((tag, header.take(length)))
        require(zlib.crc32(sections[-1][1]) == checksum, f"the checksum of {tag.decode('latin-1')} does not match")
    header.end()
    return Model(version, sections)


# Program


def differing(arrays, data):
    """Names of the arrays that are not the same as those in the bytes of a `.safetensors` file."""
    file = Bytes(data)
    try:
        tensors = json.loads(file.take(file.number("Q")))
        tensors.pop("__metadata__", None)
        body = file.data[file.at :]
        theirs = {name: body[slice(*tensor["data_offsets"])] for name, tensor in tensors.items()}
    except (ValueError, AttributeError, KeyError, TypeError):
        raise Damaged("no .safetensors file") from None
    ours = {name: struct.pack(f"<{len(numbers)}{kind}", *numbers) for name, (kind, numbers) in arrays.items()}
    return sorted(name for name in ours.keys() | theirs.keys() if ours.get(name) != theirs.get(name))


def point(model, line):
    """The base face and the barycentric coordinates in a line."""
    try:
        face, *bary = line.split()
        face, bary = int(face), list(map(float, bary))
    except ValueError:
        raise Damaged("not a face and three numbers") from None
    require(len(bary) == 3, "not a face and three numbers")
    require(0 <= face < len(model.faces), f"there is no face {face}, only 0 to {len(model.faces) - 1}")
    require(abs(sum(bary) - 1) < 1e-3, "barycentric coordinates add up to 1")
    return face, bary


def summary(model):
    names = [name for scalars in model.scalars for name in scalars.names]
    yield f"version    {model.version}"
    yield f"base mesh  {len(model.positions)} vertices, {len(model.faces)} faces"
    yield f"box        scale {model.scale:.6g}, centre " + " ".join(f"{x:.6g}" for x in model.centre)
    if model.levels:
        levels = zip(model.levels.displacements, model.levels.steps)
        levels = [f"{len(q)} displacements in steps of {step:.6g}" for q, step in levels]
        yield f"levels     {', '.join(levels) or 'none'}"
    else:
        network = model.network
        yield f"features   {len(model.features[0])} a vertex"
        yield f"network    {' → '.join(map(str, network.widths))}, {ACTIVATIONS[network.activation][0]}, " + (
            f"{network.octaves} octaves, " + ("residual" if model.residual else "not residual")
        )
    if model.metric:
        area, exponent = model.metric
        yield f"metric     area {area / model.scale**2:.6g}, exponent {exponent:.6g}"
    yield f"scalars    {', '.join(names) or 'none'}"
    yield f"provenance {json.dumps(model.provenance, ensure_ascii=False)}"


def refuse(what, error):
    sys.exit(f"{what}: {getattr(error, 'strerror', None) or error}")


def main():
    parser = argparse.ArgumentParser(description="Reads .ndf models.")
    parser.add_argument("model", metavar="MODEL.ndf")
    way = parser.add_mutually_exclusive_group()
    way.add_argument("--compare", metavar="MODEL.safetensors", help="compare arrays, bit for bit")
    way.add_argument("--evaluate", action="store_true", help="evaluate points of stdin")
    arguments = parser.parse_args()
    try:
        with open(arguments.model, "rb") as file:
            model = read(file.read())
    except (OSError, ValueError) as error:
        refuse(arguments.model, error)
    if arguments.compare:
        arrays = model.arrays()
        try:
            with open(arguments.compare, "rb") as file:
                others = differing(arrays, file.read())
        except (OSError, Damaged) as error:
            refuse(arguments.compare, error)
        if others:
            sys.exit(f"{arguments.compare}: other arrays: {', '.join(others)}")
        print(f"{len(arrays)} arrays of {sum(len(numbers) for _, numbers in arrays.values())} numbers are the same")
    elif arguments.evaluate:
        for number, line in enumerate(sys.stdin, 1):
            try:
                face, bary = point(model, line)
            except Damaged as error:
                refuse(f"line {number} of the points", error)
            print(*model.world(model.evaluate(face, bary)), *model.evaluate_scalars(face, bary))
    else:
        print(*summary(model), sep="\n")


if __name__ == "__main__":
    main()

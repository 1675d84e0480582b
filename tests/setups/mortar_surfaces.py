"""Small surfaces for the mortar tests: structured patches of every facet type, and sparse results as arrays."""

import numpy as np
from scipy.sparse import csr_matrix

TYPES_3D = ("tri3", "quad4", "tri6", "quad9")
TYPES_2D = ("line2", "line3")
NODES = {"line2": 2, "line3": 3, "tri3": 3, "tri6": 6, "quad4": 4, "quad9": 9}
DIM = {name: 2 if name.startswith("line") else 3 for name in NODES}
SECOND_ORDER = {"line3", "tri6", "quad9"}

#: node order of the same facet seen from the other side
TURNED = {
    "line2": [1, 0],
    "line3": [1, 0, 2],
    "tri3": [2, 1, 0],
    "tri6": [2, 1, 0, 4, 3, 5],
    "quad4": [3, 2, 1, 0],
    "quad9": [3, 2, 1, 0, 6, 5, 4, 7, 8],
}


def patch(facet_type, n, *, size=1.0, turned=False):
    """Positions and facets of the square (or line) of this size around the origin, n cells a side.

    The normal is the last axis, or its opposite if `turned`.
    """
    step = 2 if facet_type in SECOND_ORDER else 1
    s = (np.arange(step * n + 1) / (step * n) - 0.5) * size
    if DIM[facet_type] == 2:
        x = np.column_stack([s, 0 * s])
        i = np.arange(len(s))
        corners = [i[step::step], i[:-step:step]]
        facets = np.column_stack([*corners, i[1::2]] if step == 2 else corners)
    else:
        x = np.stack([*np.meshgrid(s, s, indexing="ij"), np.zeros((len(s), len(s)))], axis=-1).reshape(-1, 3)
        i = np.arange(len(x)).reshape(len(s), len(s))
        low, high, middle = slice(None, -step, step), slice(step, None, step), slice(1, None, 2)
        a, b, c, d = i[low, low], i[high, low], i[high, high], i[low, high]
        if step == 2:
            ab, bc, cd, da, m = i[middle, low], i[high, middle], i[middle, high], i[low, middle], i[middle, middle]
        columns = {
            "quad4": lambda: [(a, b, c, d)],
            "tri3": lambda: [(a, b, c), (a, c, d)],
            "quad9": lambda: [(a, b, c, d, ab, bc, cd, da, m)],
            "tri6": lambda: [(a, b, c, ab, bc, m), (a, c, d, m, cd, da)],
        }[facet_type]()
        facets = np.concatenate([np.column_stack([nodes.ravel() for nodes in cell]) for cell in columns])
    return x, np.ascontiguousarray(facets[:, TURNED[facet_type]] if turned else facets)


def jittered(rng, facet_type, n, amount, **settings):
    """A patch whose nodes are moved at random by `amount` cells."""
    x, facets = patch(facet_type, n, **settings)
    return x + rng.uniform(-amount, amount, x.shape) / n, facets


def all_pairs(fs, fm):
    """Every slave facet with every master facet, sorted by slave facet."""
    i, j = np.meshgrid(np.arange(len(fs)), np.arange(len(fm)), indexing="ij")
    return np.column_stack([i.ravel(), j.ravel()]).astype(np.int32)


def rotation(rng, dim):
    """A random rotation matrix."""
    q, r = np.linalg.qr(rng.normal(size=(dim, dim)))
    q = q * np.sign(np.diag(r))
    return q * np.array([*[1.0] * (dim - 1), np.linalg.det(q)])


def dense(csr, rows, columns):
    """A (data, indices, indptr) triple as an array."""
    return csr_matrix(csr, shape=(rows, columns)).toarray()

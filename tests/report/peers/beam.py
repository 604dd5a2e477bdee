"""The peers' beam by finite elements: bricks of 27 nodes, small strains, statics. Arguments: bricks through the height. Prints
one line of JSON: the tip's deflection, m, which is the reference that errors are measured from."""
import json
import sys
import time

import numpy as np
import scipy
import scipy.sparse as sp
from scipy.sparse.linalg import spsolve

LENGTH, HEIGHT, DENSITY, YOUNG, POISSON, GRAVITY = 1.0, 0.2, 1000.0, 1e6, 0.3, 0.5
start = time.process_time()
through = int(sys.argv[1])
bricks = np.array([5 * through, through, through])
nodes = 2 * bricks + 1
size = np.array([LENGTH, HEIGHT, HEIGHT]) / bricks


def shapes(t):
    """Quadratic shape functions at -1, 0 and 1, and their derivatives."""
    return np.array([t * (t - 1) / 2, 1 - t * t, t * (t + 1) / 2]), np.array([t - 0.5, -2 * t, t + 0.5])


shear = YOUNG / (2 * (1 + POISSON))
bulk = YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON))
moduli = np.diag([2 * shear] * 3 + [shear] * 3)
moduli[:3, :3] += bulk
points, weights = np.polynomial.legendre.leggauss(3)
stiffness, load = np.zeros((81, 81)), np.zeros(81)
for (p, u), (q, v), (r, w) in [
    ((points[a], weights[a]), (points[b], weights[b]), (points[c], weights[c]))
    for a in range(3) for b in range(3) for c in range(3)
]:
    (n, dn), (m, dm), (o, do) = shapes(p), shapes(q), shapes(r)
    value = np.einsum("i,j,k", n, m, o).ravel()
    slope = [np.einsum("i,j,k", *f).ravel() * 2 / s for f, s in zip([(dn, m, o), (n, dm, o), (n, m, do)], size)]
    strain = np.zeros((6, 81))
    for a in range(3):
        strain[a, a::3] = slope[a]
    for row, (a, b) in enumerate([(1, 2), (0, 2), (0, 1)]):
        strain[3 + row, a::3], strain[3 + row, b::3] = slope[b], slope[a]
    volume = u * v * w * size.prod() / 8
    stiffness += strain.T @ moduli @ strain * volume
    load[2::3] -= value * DENSITY * GRAVITY * volume
number = np.arange(nodes.prod()).reshape(nodes)
dofs = np.array([
    (3 * number[2 * i:2 * i + 3, 2 * j:2 * j + 3, 2 * k:2 * k + 3].ravel()[:, None] + np.arange(3)).ravel()
    for i, j, k in np.ndindex(*bricks)
])
rows, columns = np.repeat(dofs, 81, axis=1).ravel(), np.tile(dofs, 81).ravel()
whole = sp.csr_matrix((np.tile(stiffness.ravel(), len(dofs)), (rows, columns)))
force = np.zeros(3 * nodes.prod())
np.add.at(force, dofs.ravel(), np.tile(load, len(dofs)))
free = np.repeat(np.arange(nodes.prod()) >= nodes[1] * nodes[2], 3)
moved = np.zeros(len(force))
moved[free] = spsolve(whole[free][:, free].tocsc(), force[free])
# The mean over the section, by Simpson's rule between the nodes.
rule = np.tile([2.0, 4.0], through + 1)[:2 * through + 1]
rule[0] = rule[-1] = 1.0
rule /= rule.sum()
tip = -np.einsum("jk,j,k", moved[2::3].reshape(nodes)[-1], rule, rule)
print(json.dumps({
    "item": "beam", "n": f"{through} bricks", "peer": "finite elements by scipy", "version": scipy.__version__,
    "user_median": time.process_time() - start, "error_metric": {"tip": tip},
}))

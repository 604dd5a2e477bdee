"""Neighbourhoods along a cloud by scipy: pairs of a k-d tree, then Dijkstra's method with a limit from each of `sources`
points. Arguments: a file of little-endian f64 positions, the reach, the number of sources. Prints one line of JSON."""
import json
import sys
import time

import numpy as np
import scipy
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

points = np.fromfile(sys.argv[1], "<f8").reshape(-1, 3)
reach, sources = float(sys.argv[2]), int(sys.argv[3])
start = time.process_time()
i, j = cKDTree(points).query_pairs(reach, output_type="ndarray").T
length = np.linalg.norm(points[i] - points[j], axis=1)
graph = csr_matrix((np.r_[length, length], (np.r_[i, j], np.r_[j, i])), (len(points),) * 2)
built = time.process_time() - start
# Spread over the cloud; what a source costs is multiplied by the points that there are.
chosen = np.linspace(0, len(points) - 1, sources).astype(int)
start = time.process_time()
seen = 0
for part in np.array_split(chosen, max(1, sources * len(points) // 20_000_000)):
    seen += np.isfinite(dijkstra(graph, indices=part, limit=reach)).sum()
searched = (time.process_time() - start) * len(points) / sources
print(json.dumps({
    "item": "neighbourhoods", "n": str(len(points)), "peer": "scipy cKDTree + dijkstra", "version": scipy.__version__,
    "user_median": built + searched,
    "error_metric": {"graph_seconds": built, "seen": float(seen) / sources - 1},
}))

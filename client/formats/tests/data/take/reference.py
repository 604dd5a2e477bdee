"""Makes reference.json: what programs other than Sinew read in the captures that the tests use.

    pip install numpy==2.* ezc3d==1.7.2 c3d==0.6.0 gsd==5.0.1 pandas==3.* ase==3.29.0
    python reference.py SHARED/mocap/*/*.{c3d,trc,bvh} SHARED/mocap/csv/{motive123_markers.csv,vicon*,qualisys*} SHARED/particles/*.{xyz,lammpstrj} \\
        freebvh_cut.bvh small_nexus.csv small_*.{gsd,tsv,lammpstrj,xyz} > reference.json

C3D: ezc3d where it reads the file, else (MIPS) py-c3d. BVH: forward kinematics in numpy. TRC: plain string splitting.
Text exports and LAMMPS: pandas, without labels and rates. XYZ: ase. GSD: gsd, which
also wrote the file: eight particles that move in a triclinic box, some through its walls.
For some frames it lists every few points: [frame, point, [x, y, z]] in metres, null where the point is not seen.
"""
import io, json, math, os, sys, warnings
import numpy as np
import ase, ase.io
import ezc3d, c3d
import pandas as pd
warnings.simplefilter("ignore")
METRES = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254}

def summary(how, labels, rate, first, xyz):  # xyz: frames x points x 3, NaN = missing
    missing = np.isnan(xyz).any(axis=2)
    frames, points = missing.shape
    longest = 0
    for p in range(points):
        run = 0
        for m in missing[:, p]:
            run = run + 1 if m else 0
            longest = max(longest, run)
    step = -(-points // 8)
    pick = [(f, p) for f in sorted({0, frames // 3, frames // 2, frames - 1}) for p in range(f % step, points, step)]
    never = missing.all(axis=0)
    return dict(how=how, frames=frames, points=points, rate_hz=rate, first_time_seconds=first,
        missing=int(missing.sum()), points_with_gaps=int((missing.any(axis=0) & ~never).sum()), never_seen=int(never.sum()),
        longest_gap=longest, labels=labels,
        samples=[[f, p, None if missing[f, p] else [round(float(x), 9) for x in xyz[f, p]]] for f, p in pick])

def by_ezc3d(path):
    f = ezc3d.c3d(path)
    point = f["parameters"]["POINT"]
    unit = METRES[point["UNITS"]["value"][0].strip()]
    xyz = f["data"]["points"][:3].transpose(2, 1, 0).astype(float) * unit
    residual = f["data"]["meta_points"]["residuals"][0].T
    xyz[residual < 0] = np.nan
    labels = []
    for key in ["LABELS"] + [f"LABELS{i}" for i in range(2, 9)]:
        if key in point: labels += [str(v).strip() for v in point[key]["value"]]
    rate = float(f["header"]["points"]["frame_rate"])
    first = int(f["header"]["points"]["first_frame"])  # ezc3d counts from 0
    return summary("ezc3d " + ezc3d.__version__, labels[: xyz.shape[1]], rate, max(first, 0) / rate, xyz)

def by_pyc3d(path):
    r = c3d.Reader(open(path, "rb"))
    unit = METRES[r.get("POINT:UNITS").string_value.strip()]
    xyz = []
    for _, points, _ in r.read_frames(copy=True):
        row = points[:, :3].astype(float) * unit
        row[points[:, 3] < 0] = np.nan
        xyz.append(row)
    rate = float(r.point_rate)
    labels = [l.strip() for l in r.point_labels][: xyz[0].shape[0]]
    return summary("py-c3d", labels, rate, max(r.first_frame - 1, 0) / rate, np.array(xyz))

def by_split(path):
    lines = open(path, newline="").read().replace("\r\n", "\n").split("\n")
    head = dict(zip(lines[1].split("\t"), lines[2].split("\t")))
    labels = [c for c in lines[3].split("\t")[2:] if c.strip()]
    rows = [l.split("\t") for l in lines[5:] if l.strip()]
    number = lambda c: float(c) if c.strip() else math.nan
    xyz = np.array([[number(c) for c in r[2 : 2 + 3 * len(labels)]] for r in rows]).reshape(len(rows), -1, 3)
    return summary("string splitting", labels, float(head["DataRate"]), float(rows[0][1]), xyz * METRES[head["Units"].strip()])

def by_numpy(path):
    text = open(path).read()
    hierarchy, motion = text.split("MOTION")
    tokens = hierarchy.replace("{", " { ").replace("}", " } ").split()
    nodes, stack, i = [], [], 1
    while i < len(tokens):
        t = tokens[i]
        if t in ("ROOT", "JOINT", "End"):
            name = nodes[stack[-1]]["name"] + "_end" if t == "End" else tokens[i + 1]
            nodes.append(dict(name=name, parent=stack[-1] if stack else -1, channels=[]))
            i += 2
        elif t == "{": stack.append(len(nodes) - 1); i += 1
        elif t == "}": stack.pop(); i += 1
        elif t == "OFFSET": nodes[-1]["offset"] = [float(x) for x in tokens[i + 1 : i + 4]]; i += 4
        elif t == "CHANNELS": n = int(tokens[i + 1]); nodes[-1]["channels"] = tokens[i + 2 : i + 2 + n]; i += 2 + n
        else: raise ValueError(t)
    m = motion.strip().split("\n")
    dt = float(m[1].split(":")[1])
    rows = np.array([[float(x) for x in l.split()] for l in m[2:] if l.strip()])
    def turn(axis, degrees):
        c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
        return np.array({"X": [[1, 0, 0], [0, c, -s], [0, s, c]], "Y": [[c, 0, s], [0, 1, 0], [-s, 0, c]], "Z": [[c, -s, 0], [s, c, 0], [0, 0, 1]]}[axis])
    xyz = np.empty((len(rows), len(nodes), 3))
    for f, row in enumerate(rows):
        at, world = 0, []
        for k, n in enumerate(nodes):
            local = np.eye(4); local[:3, 3] = n["offset"]
            for ch in n["channels"]:
                if ch.endswith("position"): local["XYZ".index(ch[0]), 3] = row[at]
                at += 1
            at -= len(n["channels"])
            for ch in n["channels"]:
                if ch.endswith("rotation"):
                    r = np.eye(4); r[:3, :3] = turn(ch[0], row[at]); local = local @ r
                at += 1
            world.append(local if n["parent"] < 0 else world[n["parent"]] @ local)
            xyz[f, k] = world[-1][:3, 3]
        assert at == rows.shape[1]
    return summary("numpy forward kinematics", [n["name"] for n in nodes], float(round(1 / dt)), 0.0, xyz * 0.01)

def by_gsd(path):
    import gsd.hoomd, gsd.version
    xyz = []
    with gsd.hoomd.open(path) as frames:
        for frame in frames:
            x, y, z, xy, xz, yz = (float(v) for v in frame.configuration.box)
            edges = np.array([[x, xy * y, xz * z], [0, y, yz * z], [0, 0, z]])
            xyz.append(frame.particles.position.astype(float) + frame.particles.image @ edges.T)
    xyz = np.array(xyz)  # no rate: 60 Hz are assumed
    return summary("gsd " + gsd.version.version, [f"p{i + 1}" for i in range(xyz.shape[1])], 60.0, 0.0, xyz)

def by_pandas(path):
    """The text exports: the first rows of numbers alone, and below them a frame, a time or sub-frame, and triples."""
    text = open(path, encoding="utf-8-sig").read().replace("\r\n", "\n").split("\n")
    sep = "\t" if path.endswith("tsv") else ","
    def numbers(line):
        cells = [c for c in line.split(sep) if c.strip()]
        try: return len([float(c) for c in cells]) > 4
        except ValueError: return False
    first = next(i for i, line in enumerate(text) if numbers(line))
    table = pd.read_csv(path, sep=sep, header=None, skiprows=first, encoding="utf-8-sig")
    xyz = table.iloc[:, 2:].to_numpy(float)
    xyz = xyz[:, : xyz.shape[1] // 3 * 3].reshape(len(table), -1, 3) * 1e-3
    if sep == "\t": xyz[(xyz == 0).all(axis=2)] = np.nan  # Qualisys' gaps
    return summary("pandas " + pd.__version__, [], None, None, xyz)

def by_ase(path):
    xyz = np.array([atoms.get_positions() for atoms in ase.io.read(path, index=":", format="xyz")])
    return summary("ase " + ase.__version__, [], None, None, xyz)

def by_columns(path):
    """LAMMPS: pandas for the rows; scaled coordinates are shares of the box, image flags count boxes."""
    xyz = []
    for frame in open(path).read().split("ITEM: TIMESTEP\n")[1:]:
        box, rows = frame.split("ITEM: BOX BOUNDS")[1].split("\n", 1)[1].split("ITEM: ATOMS ")
        low, high = np.array([[float(x) for x in line.split()] for line in box.strip().split("\n")]).T
        names, rows = rows.split("\n", 1)
        table = pd.read_csv(io.StringIO(rows), sep=r"\s+", header=None, names=names.split())
        if "id" in table: table = table.sort_values("id")
        scaled = "xs" in table
        if not scaled and "z" not in table: table["z"] = 0.0  # a plane
        place = table[["xs", "ys", "zs"] if scaled else ["x", "y", "z"]].to_numpy(float)
        place = low + place * (high - low) if scaled else place
        if "ix" in table: place = place + table[["ix", "iy", "iz"]].to_numpy(float) * (high - low)
        xyz.append(place)
    return summary("pandas " + pd.__version__, [], None, None, np.array(xyz))

out = {}
for path in sys.argv[1:]:
    name = os.path.basename(path)
    if name.endswith("trc"):
        out[name] = by_split(path)
    elif name.endswith("bvh"):
        out[name] = by_numpy(path)
    elif name.endswith(("csv", "tsv")):
        out[name] = by_pandas(path)
    elif name.endswith("xyz"):
        out[name] = by_ase(path)
    elif name.endswith("lammpstrj"):
        out[name] = by_columns(path)
    elif name.endswith("gsd"):
        out[name] = by_gsd(path)
    else:
        try:
            out[name] = by_ezc3d(path)
        except RuntimeError:
            out[name] = by_pyc3d(path)
rows = ",\n".join(f"{json.dumps(name)}: {json.dumps(out[name])}" for name in sorted(out))
print("{\n" + rows + "\n}")

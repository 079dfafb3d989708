"""Interpolation of many scattered values by batten and by others, on the same points in the same run; and surfaces
through oriented points.

Usage: large_peers.py --fits PROGRAM [--batten PROGRAM] [--install FOLDER] [--json FILE] [--limit S] [--large] [--only PART]
  --fits      large-fits
  --batten    the program, for surfaces
  --install   a virtual environment to use, made where it is missing, with ferreus-rbf, jizai and open3d-cpu from PyPI as
              far as they install
  --limit     seconds that one fit may take, default 120; what takes longer is ended and said to
  --large     100,000 points too
  --only      scenes whose names contain it

Interpolants of a scene are all the same function in exact arithmetic: same kernel, same polynomial part. Only SciPy's
with neighbors=50 are not. A tenth of the points (at most 10,000) is held out; errors there are those of the method,
"at data" is how far the interpolant misses 2,000 of its own points; both over the range of the values. Each fit is a
process of its own, whose peak of resident memory counts (with Python, where it is Python's). What is absent is said and
left out."""
import argparse
import importlib.util
import json
import os
import subprocess
import sys
import tempfile
import time

PACKAGES = ["ferreus-rbf", "jizai", "open3d-cpu"]
DENSE_BYTES = 4e9  # SciPy's matrix and its factors
CHECKED, HELD_MOST = 2000, 10000


def peak_bytes():
    """Of this process since exec; ru_maxrss would begin with the parent's."""
    for line in open("/proc/self/status"):
        if line.startswith("VmHWM:"):
            return 1024 * int(line.split()[1])
    return 0


# ---- in a process of its own: one way on one file ----

def read(path):
    import numpy as np
    numbers = np.fromfile(path)
    n, count, queries = (int(x) for x in numbers[:3])
    rows = numbers[3:3 + count * (n + 1)].reshape(count, n + 1)
    return rows[:, :n].copy(), rows[:, n].copy(), numbers[3 + count * (n + 1):].reshape(queries, n).copy()


def scipy_global(points, values, m, accuracy, neighbors=None):
    from scipy.interpolate import RBFInterpolator
    kernel = {(3, 2): "linear", (3, 3): "cubic", (2, 2): "thin_plate_spline"}[points.shape[1], m]
    return RBFInterpolator(points, values, kernel=kernel, degree=m - 1, neighbors=neighbors), None


def scipy_local(points, values, m, accuracy):
    return scipy_global(points, values, m, accuracy, 50)


def ferreus(points, values, m, accuracy):
    from ferreus_rbf import RBFInterpolator
    from ferreus_rbf import interpolant_config as config
    kernel = {(3, 2): "Linear", (3, 3): "Cubic", (2, 2): "ThinPlateSpline"}[points.shape[1], m]
    drift = {2: "Linear", 3: "Quadratic"}[m]
    tolerance = config.FittingAccuracy(accuracy, config.FittingAccuracyType.Relative)
    settings = config.InterpolantSettings(getattr(config.RBFKernelType, kernel), drift=getattr(config.Drift, drift),
                                          fitting_accuracy=tolerance)
    fitted = RBFInterpolator(points, values, settings)
    return fitted.evaluate, None


def jizai(points, values, m, accuracy):
    import jizai as package
    n = points.shape[1]
    kernel = {(3, 2): "Biharmonic3D", (3, 3): "Triharmonic3D", (2, 2): "Biharmonic2D"}[n, m]
    fitted = package.Interpolant(package.Model(getattr(package, kernel)(dim=n), m - 1))
    extent = float(values.max() - values.min())
    fitted.fit(points, values, tolerance=accuracy * extent, accuracy=0.01 * accuracy * extent)
    return fitted.evaluate, None


WAYS = {"scipy": scipy_global, "scipy-local": scipy_local, "ferreus": ferreus, "jizai": jizai}


def child(way, path, m, accuracy):
    points, values, places = read(path)
    start = time.perf_counter()
    evaluate, _ = WAYS[way](points, values, m, accuracy)
    fitted = time.perf_counter()
    out = evaluate(places)
    end = time.perf_counter()
    out.astype(float).tofile(path + ".out")
    print(fitted - start, end - fitted, peak_bytes(), flush=True)


def child_poisson(path, out, depth):
    import numpy as np
    import open3d
    numbers = np.fromfile(path).reshape(-1, 6)
    cloud = open3d.geometry.PointCloud()
    cloud.points = open3d.utility.Vector3dVector(numbers[:, :3])
    cloud.normals = open3d.utility.Vector3dVector(numbers[:, 3:])
    start = time.perf_counter()
    mesh, _ = open3d.geometry.TriangleMesh.create_from_point_cloud_poisson(cloud, depth=depth)
    end = time.perf_counter()
    np.asarray(mesh.vertices).tofile(out)
    print(end - start, len(mesh.triangles), peak_bytes(), flush=True)


# ---- scenes ----

class Scene:
    def __init__(self, name, m, points, values, accuracy=1e-6):
        import numpy as np
        random = np.random.default_rng(2)
        count = len(points)
        held = random.permutation(count)[:min(count // 10, HELD_MOST)]
        kept = np.setdiff1d(np.arange(count), held)
        checked = random.choice(kept, min(CHECKED, len(kept)), replace=False)
        self.name, self.m, self.accuracy = name, m, accuracy
        self.points, self.values = points[kept], values[kept]
        self.places = np.concatenate([points[held], points[checked]])
        self.truth, self.held = np.concatenate([values[held], values[checked]]), len(held)
        self.extent = float(np.ptp(values))

    def write(self, path):
        import numpy as np
        n = self.points.shape[1]
        head = np.array([n, len(self.points), len(self.places)], float)
        np.concatenate([head, np.column_stack([self.points, self.values]).ravel(), self.places.ravel()]).tofile(path)


def bumps(directions):
    import numpy as np
    x, y, z = directions.T
    a = np.arctan2(y, x)
    return 1 + 0.1 * np.sin(5 * a) * (1 - z * z) + 0.05 * np.cos(9 * z)


def sphere(random, count):
    import numpy as np
    p = random.normal(size=(count, 3))
    return p / np.linalg.norm(p, axis=1)[:, None]


def wave(p):
    import numpy as np
    return np.sin(3 * p[:, 0]) * np.cos(2 * p[:, 1]) + np.exp(-p[:, 2] ** 2) * p[:, 0]


def franke(p):
    import numpy as np
    x, y = 9 * p.T
    return (0.75 * np.exp(-((x - 2) ** 2 + (y - 2) ** 2) / 4) + 0.75 * np.exp(-(x + 1) ** 2 / 49 - (y + 1) / 10)
            + 0.5 * np.exp(-((x - 7) ** 2 + (y - 3) ** 2) / 4) - 0.2 * np.exp(-(x - 4) ** 2 - (y - 7) ** 2))


def phobos():
    """The distance from the centre over the direction, of all points of the shape model; a made body where it is not
    at hand."""
    import numpy as np
    path = os.path.join(os.environ.get("BATTEN_SHARED", ""), "data/phobos/phobos_thomas_xyz.txt")
    if os.path.exists(path):
        x, name = np.unique(np.loadtxt(path, comments="#")[:, :3], axis=0), "Phobos"
    else:
        directions = sphere(np.random.default_rng(4), 16022)
        x, name = directions * (11 * bumps(directions))[:, None], "a bumpy body (no Phobos here)"
    radius = np.linalg.norm(x, axis=1)
    return name + ": radius over direction, kernel r", x / radius[:, None], radius


def scenes(large):
    import numpy as np
    random = np.random.default_rng(1)
    for count in [5000, 10000, 30000] + [100000] * large:
        p = sphere(random, count)
        p *= bumps(p)[:, None]
        yield Scene("values on a bumpy sphere, kernel r", 2, p, wave(p))
    name, p, radius = phobos()
    yield Scene(name, 2, p, radius)
    for count in [10000] + [100000] * large:
        p = random.uniform(-1, 1, (count, 3))
        yield Scene("values in a cube, kernel r", 2, p, wave(p))
    for count in [10000] + [100000] * large:
        p = random.uniform(size=(count, 2))
        yield Scene("a surface over the plane, kernel r^2 ln r", 2, p, franke(p))
    p = random.uniform(-1, 1, (10000, 3))
    yield Scene("values in a cube, kernel r^3", 3, p, wave(p))


# ---- running ----

def run(command, limit):
    """The words that it prints, or what went wrong."""
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=limit)
    except subprocess.TimeoutExpired:
        return None, f"ended after {limit:g} s"
    if done.returncode:
        lines = done.stderr.strip().split("\n")
        return None, lines[-1][:120] if lines[-1] else f"ends with {done.returncode}"
    return done.stdout.split(None, 3), ""


def measure(label, command, scene, path, limit):
    import numpy as np
    row = dict(scene=scene.name, n=len(scene.points), way=label)
    words, row["note"] = run(command, limit)
    if words is None:
        return row
    out = np.fromfile(path + ".out").ravel()
    wrong = np.abs(out - scene.truth) / scene.extent
    held, data = wrong[:scene.held], wrong[scene.held:]
    row.update(fit_s=float(words[0]), values_s=float(words[1]), bytes=int(words[2]), held_rms=float(np.sqrt((held ** 2).mean())),
               held_max=float(held.max()), data_max=float(data.max()), note=words[3].strip() if len(words) > 3 else "")
    os.remove(path + ".out")
    return row


def print_row(row):
    if "fit_s" in row:
        print(f"| {row['way']} | {row['fit_s']:.2f} | {row['values_s']:.2f} | {row['bytes'] / 1e9:.2f} | {row['held_rms']:.2e} | "
              f"{row['held_max']:.2e} | {row['data_max']:.1e} | {row['note']} |", flush=True)
    else:
        print(f"| {row['way']} | | | | | | | {row['note']} |", flush=True)


def ways(options, python, scene):
    """(label, command without the file's name first, or why it is left out)"""
    count, fits, a = len(scene.points), options.fits, repr(scene.accuracy)
    own = [python, os.path.abspath(__file__), "--child"]
    dense = 16.0 * count ** 2 <= DENSE_BYTES
    if dense:
        yield "batten, factors", [fits, "FILE", "cholesky-mixed", str(scene.m), a]
    yield f"batten, iterative, {scene.accuracy:g}", [fits, "FILE", "iterative", str(scene.m), a]
    if scene.accuracy > 1e-9:
        yield "batten, iterative, 1e-9", [fits, "FILE", "iterative", str(scene.m), "1e-9"]
    if dense:
        yield "SciPy", [*own, "scipy", "FILE", str(scene.m), a]
    else:
        yield "SciPy", f"left out: takes {16e-9 * count ** 2:.0f} GB"
    yield "SciPy, 50 neighbours", [*own, "scipy-local", "FILE", str(scene.m), a]
    if options.has["ferreus_rbf"]:
        yield f"ferreus-rbf, {scene.accuracy:g}", [*own, "ferreus", "FILE", str(scene.m), a]
    if options.has["jizai"]:
        yield f"jizai, {scene.accuracy:g}", [*own, "jizai", "FILE", str(scene.m), a]


def interpolation(options, python, folder):
    rows, path = [], os.path.join(folder, "scene")
    for scene in scenes(options.large):
        if options.only not in scene.name:
            continue
        scene.write(path)
        print(f"\n### {scene.name}: {len(scene.points)} points, {scene.held} held out\n\n| | fit s | values s | peak GB | "
              "held out, rms | largest | at data | |\n|---|---|---|---|---|---|---|---|", flush=True)
        for label, command in ways(options, python, scene):
            if isinstance(command, str):
                row = dict(scene=scene.name, n=len(scene.points), way=label, note=command)
            else:
                row = measure(label, [path if w == "FILE" else w for w in command], scene, path, options.limit)
            print_row(row)
            rows.append(row)
    return rows


# ---- surfaces ----

def oriented(count):
    """Points of the bumpy sphere and its outward normals: the gradient of |x| - R(x / |x|), by differences."""
    import numpy as np
    p = sphere(np.random.default_rng(3), count)
    p *= bumps(p)[:, None]

    def f(x):
        r = np.linalg.norm(x, axis=1)
        return r - bumps(x / r[:, None])
    h = 1e-6
    g = np.stack([f(p + h * e) - f(p - h * e) for e in np.eye(3)], axis=1)
    return p, g / np.linalg.norm(g, axis=1)[:, None]


def surface_row(label, count, words, note, vertices):
    import numpy as np
    row = dict(scene="surface", n=count, way=label, note=note)
    if words is not None:
        r = np.linalg.norm(vertices, axis=1)
        wrong = np.abs(r - bumps(vertices / r[:, None]))
        row.update(seconds=float(words[0]), triangles=int(words[1]), bytes=int(words[2]),
                   rms=float(np.sqrt((wrong ** 2).mean())), largest=float(wrong.max()))
        print(f"| {count} | {label} | {row['seconds']:.2f} | {row['bytes'] / 1e9:.2f} | {row['triangles']} | {row['rms']:.1e} | "
              f"{row['largest']:.1e} | |", flush=True)
    else:
        print(f"| {count} | {label} | | | | | | {note} |", flush=True)
    return row


def child_solid(batten, points, out, cell):
    """The program, in a process that has no numbers of its own."""
    import resource
    start = time.perf_counter()
    done = subprocess.run([batten, "solid", points, "--quiet", "-o", out, "--cell", cell], capture_output=True, text=True)
    seconds = time.perf_counter() - start
    if done.returncode:
        sys.exit(done.stderr.strip())
    triangles = 0
    for line in open(out, "rb"):
        if line.startswith(b"element face"):
            triangles = int(line.split()[2])
        if line.startswith(b"end_header"):
            break
    print(seconds, triangles, 1024 * resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss, flush=True)


def read_ply(path):
    """Vertices: x y z first, doubles or floats, little-endian, as the program writes them."""
    import numpy as np
    with open(path, "rb") as file:
        fields, count, inside = [], 0, False
        for line in file:
            words = line.split()
            if words[0] == b"element":
                inside = words[1] == b"vertex"
                count = int(words[2]) if inside else count
            elif words[0] == b"property" and inside:
                fields.append((words[2].decode(), {b"double": "<f8", b"float": "<f4", b"uchar": "u1"}[words[1]]))
            elif words[0] == b"end_header":
                break
        rows = np.frombuffer(file.read(count * np.dtype(fields).itemsize), np.dtype(fields))
    return np.column_stack([rows["x"], rows["y"], rows["z"]]).astype(float)


def surfaces(options, python, folder):
    import numpy as np
    rows, cell = [], 0.015
    print("\n### Surfaces through points of a bumpy sphere of radius 1\n\nErrors are those of the vertices. Poisson is given the "
          "normals; batten is not.\n\n| N | | seconds | peak GB | triangles | error, rms | largest | |\n"
          "|---|---|---|---|---|---|---|---|")
    for count in [10000, 30000] + [100000] * options.large:
        p, normals = oriented(count)
        text, numbers, out = (os.path.join(folder, name) for name in ("points.xyz", "points", "mesh"))
        np.savetxt(text, p, fmt="%.17g")
        np.column_stack([p, normals]).tofile(numbers)
        own = [python, os.path.abspath(__file__)]
        if options.batten:
            words, note = run([*own, "--solid", options.batten, text, out + ".ply", str(cell)], options.limit)
            rows.append(surface_row("batten solid", count, words, note, words and read_ply(out + ".ply")))
        if options.has["open3d"]:
            for depth in (7, 9):
                words, note = run([*own, "--poisson", numbers, out, str(depth)], options.limit)
                rows.append(surface_row(f"Open3D, Poisson, depth {depth}", count, words, note,
                                        words and np.fromfile(out).reshape(-1, 3)))
    return rows


# ---- all ----

def environment(folder):
    """The Python of a virtual environment with the peers, made where it is missing."""
    python = os.path.join(folder, "bin", "python")
    if not os.path.exists(python):
        subprocess.run([sys.executable, "-m", "venv", "--system-site-packages", folder], check=True)
    for package in PACKAGES:
        have = subprocess.run([python, "-m", "pip", "show", "-q", package], capture_output=True).returncode == 0
        if not have and subprocess.run([python, "-m", "pip", "install", "-q", package], capture_output=True).returncode:
            print(f"{package}: does not install here")
    return python


def versions(python):
    text = ("import importlib.metadata as m\nfor p in ('numpy', 'scipy', 'ferreus-rbf', 'jizai', 'open3d-cpu', 'open3d'):\n"
            "  try: print(p, m.version(p), end='; ')\n  except m.PackageNotFoundError: pass")
    return subprocess.run([python, "-c", text], capture_output=True, text=True).stdout.rstrip("; ")


def works(python, module):
    return subprocess.run([python, "-c", f"import {module}"], capture_output=True).returncode == 0


def main():
    words = sys.argv[1:]
    if words[:1] == ["--child"]:
        return child(words[1], words[2], int(words[3]), float(words[4]))
    if words[:1] == ["--poisson"]:
        return child_poisson(words[1], words[2], int(words[3]))
    if words[:1] == ["--solid"]:
        return child_solid(*words[1:])
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fits", required=True)
    parser.add_argument("--batten")
    parser.add_argument("--install")
    parser.add_argument("--json")
    parser.add_argument("--limit", type=float, default=120)
    parser.add_argument("--large", action="store_true")
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    if importlib.util.find_spec("numpy") is None or importlib.util.find_spec("scipy") is None:
        print("the benchmark of many points beside peers needs NumPy and SciPy; nothing was run")
        return 0
    python = environment(options.install) if options.install else sys.executable
    options.has = {module: works(python, module) for module in ("ferreus_rbf", "jizai", "open3d")}
    print(f"# Many points: peers\n\n{versions(python)}; {os.cpu_count()} cores")
    for module, there in options.has.items():
        if not there:
            print(f"({module} is absent: --install FOLDER)")
    with tempfile.TemporaryDirectory() as folder:
        rows = interpolation(options, python, folder)
        if options.only in "surfaces":
            rows += surfaces(options, python, folder)
    if options.json:
        with open(options.json, "w", encoding="utf-8") as file:
            json.dump(dict(versions=versions(python), cores=os.cpu_count(), rows=rows), file, indent=1)
    return 0


if __name__ == "__main__":
    sys.exit(main())

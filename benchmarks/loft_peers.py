"""Surfaces through contours by batten and by others, through the same contours in the same run.

The others are plain skinning: control points of the contours on common knots, interpolated across them by splines.
Counted are pairs of patch and span of t over which both contours bend to one side and a section between them does
not: at 17 x 17 places of each pair, and by batten's proof, which also tells of what lies between places and takes a pair
with an inflection at its end only where the surface is flat there to rounding, as skinned ones are not.
Times are medians of several builds on one thread."""
import argparse
import csv
import os
import statistics
import subprocess
import sys
import tempfile
import time

for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ[variable] = "1"

try:
    import numpy as np
    import scipy
    from scipy import interpolate
    import scipy.sparse.linalg
except ImportError as missing:
    print(f"the benchmark of lofts beside peers needs NumPy and SciPy ({missing}); nothing was run")
    sys.exit(0)

LIMIT = 300  # seconds a build; what takes longer is said to
PLACES = 17


class Scene:
    """As loft-fits wrote it."""

    def __init__(self, folder, name, text):
        self.name, self.text, self.path = name, text, os.path.join(folder, name + ".scene")
        numbers = np.fromfile(self.path)
        count, self.closed, self.degree, self.smoothness = (int(x) for x in numbers[:4])
        self.heights, self.contours, at = [], [], 4
        for _ in range(count):
            knots = int(numbers[at + 1])
            points = knots - self.degree - 1
            self.heights.append(numbers[at])
            begin = at + 2 + knots
            self.contours.append(interpolate.BSpline(numbers[at + 2:begin],
                                                     numbers[begin:begin + 2 * points].reshape(-1, 2), self.degree))
            at = begin + 2 * points
        self.heights = np.array(self.heights)
        self.size = np.ptp(np.concatenate([c.c for c in self.contours]), axis=0).max()


class Surface:
    def __init__(self, seconds, builds, degrees, knots, control, parameters):
        self.seconds, self.builds = seconds, int(builds)
        self.degrees, self.knots, self.control, self.parameters = degrees, knots, control, parameters

    def along(self, way, places, order):
        """Values of all basis functions, dense: [places][functions]."""
        knots, degree = self.knots[way], self.degrees[way]
        values = interpolate.BSpline(knots, np.eye(len(knots) - degree - 1), degree)
        return values(np.clip(places, knots[degree], knots[-degree - 1]), order)

    def sections(self, t, v, order):
        """Derivatives by t: [t][v][3]."""
        polygons = np.tensordot(self.control, self.along(1, v, 0), axes=(1, 1))
        return np.tensordot(self.along(0, t, order), polygons, axes=1).transpose(0, 2, 1)


# ---- the ways: each takes scene, file for the surface, seconds for its repeats ----

class Program:
    def __init__(self, label, program, *words):
        self.label, self.command = label, [program, *words]

    def build(self, scene, path, seconds):
        run = subprocess.run([*self.command, scene.path, path, str(seconds)], capture_output=True, text=True,
                             timeout=LIMIT)
        if run.returncode:
            raise RuntimeError(run.stderr.strip().split("\n")[-1][:150] or f"ends with {run.returncode}")
        numbers = np.fromfile(path)
        degrees, counts = numbers[2:4].astype(int), numbers[4:6].astype(int)
        knots = numbers[6:6 + counts[0]], numbers[6 + counts[0]:6 + counts.sum()]
        shape = *(counts - degrees - 1), 3
        at = 6 + counts.sum()
        control = numbers[at:at + np.prod(shape)].reshape(shape)
        return Surface(*numbers[:2], degrees, knots, control, numbers[at + np.prod(shape):]), run.stderr.strip()


class SciPy:
    """Common knots by interpolation at their Greville abscissas, which is exact, and splines through the heights."""

    def __init__(self, label, make):
        self.label, self.make = label, make

    def build(self, scene, path, seconds):
        times, begin = [], time.perf_counter()
        while not times or len(times) < 25 and time.perf_counter() - begin < seconds:
            start = time.perf_counter()
            surface = self.skin(scene)
            times.append(time.perf_counter() - start)
        surface.seconds, surface.builds = statistics.median(times), len(times)
        return surface, ""

    def skin(self, scene):
        d = scene.degree
        inner = [c.t[d + 1:-d - 1] for c in scene.contours]
        breaks = np.unique(np.concatenate(inner))
        folds = [max(np.count_nonzero(knots == b) for knots in inner) for b in breaks]
        knots = np.concatenate([np.zeros(d + 1), np.repeat(breaks, folds), np.ones(d + 1)])
        places = np.array([knots[j + 1:j + d + 1].mean() for j in range(len(knots) - d - 1)])
        basis = interpolate.BSpline.design_matrix(np.clip(places, 0, 1), knots, d).tocsc()
        solve = scipy.sparse.linalg.factorized(basis)
        control = np.array([[solve(np.ascontiguousarray(x)) for x in c(places).T] for c in scene.contours])
        across = self.make(scene.heights, control.transpose(0, 2, 1))
        points = np.empty((len(places), len(across.t) - across.k - 1, 3))
        points[:, :, :2] = across.c.transpose(1, 0, 2)
        points[:, :, 2] = [across.t[j + 1:j + across.k + 1].mean() for j in range(points.shape[1])]
        return Surface(0, 0, (d, across.k), (knots, across.t), points, scene.heights)


def cubic(heights, control):
    return interpolate.make_interp_spline(heights, control, k=min(3, len(heights) - 1))


def all_ways(fits, sisl):
    ways = [Program("batten, loft", fits, "fit", "loft"),
            Program("batten, cubic", fits, "fit", "cubic"),
            Program("batten, cubic, without inequalities", fits, "fit", "free"),
            SciPy("SciPy make_interp_spline, cubic", cubic)]
    if sisl:
        ways.append(Program("SISL s1538, cubic", sisl))
    return ways


# ---- figures ----

def cross(a, b):
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def wanted_signs(below, above, breaks):
    """By span of t: the one sign that both contours have, else 0. Ends of spans, where x'' may vanish, do not count."""
    out = []
    for a, b in zip(breaks, breaks[1:]):
        t = a + (b - a) * (np.arange(PLACES) + 0.5) / PLACES
        signs = []
        for c in (below, above):
            first, second = c(t, 1), c(t, 2)
            w = cross(first, second)
            tiny = 1e-9 * np.linalg.norm(first, axis=1) * np.linalg.norm(second, axis=1)
            signs.append(1 if np.all(w > tiny) else -1 if np.all(w < -tiny) else 0)
        out.append(signs[0] if signs[0] == signs[1] else 0)
    return np.array(out)


def violations(scene, surface):
    """Pairs, those with wrong signs, and the largest distance from the contours over the size."""
    pairs = wrong = 0
    off = 0.0
    t = np.linspace(0, 1, 401)
    for i, contour in enumerate(scene.contours):
        at = surface.sections(t, surface.parameters[i:i + 1], 0)[:, 0]
        off = max(off, np.abs(at[:, :2] - contour(t)).max(), np.abs(at[:, 2] - scene.heights[i]).max())
    for i in range(len(scene.contours) - 1):
        below, above = scene.contours[i:i + 2]
        breaks = np.unique(np.concatenate([below.t, above.t]))
        signs = wanted_signs(below, above, breaks)
        v = np.linspace(*surface.parameters[i:i + 2], PLACES)
        t = breaks[:-1, None] + np.diff(breaks)[:, None] * (np.arange(PLACES) + 0.5) / PLACES
        first, second = (surface.sections(t.ravel(), v, order) for order in (1, 2))
        tiny = 1e-9 * np.linalg.norm(first, axis=-1) * np.linalg.norm(second, axis=-1)
        bad = np.repeat(signs, PLACES)[:, None] * cross(first, second) < -tiny
        pairs += np.count_nonzero(signs)
        wrong += np.count_nonzero(bad.reshape(len(signs), -1).any(axis=1) & (signs != 0))
    return pairs, wrong, off / scene.size


def prove(fits, surface, path):
    """Pairs, those with wrong signs, and unproven ones, of the surface with knots at all contours."""
    degree, knots, inside = surface.degrees[1], surface.knots[1], surface.parameters[1:-1]
    known = np.array([np.any(np.isclose(knots, v, rtol=0, atol=1e-12 * np.ptp(knots))) for v in inside], bool)
    across = interpolate.BSpline(knots, surface.control.transpose(1, 0, 2), degree)
    for v in inside[~known]:
        across = interpolate.BSpline(*boehm(across, v), degree)
    numbers = np.concatenate([[0, 0, *surface.degrees, len(surface.knots[0]), len(across.t)], surface.knots[0],
                              across.t, across.c.transpose(1, 0, 2).ravel()])
    numbers.tofile(path)
    run = subprocess.run([fits, "prove", path], capture_output=True, text=True, timeout=LIMIT)
    if run.returncode:
        raise RuntimeError("proof: " + run.stderr.strip()[:150])
    return [int(x) for x in run.stdout.split()]


def boehm(spline, v):
    """Knots and control points with one more knot."""
    t, c, d = spline.t, spline.c, spline.k
    mu = np.searchsorted(t, v, side="right") - 1
    out = np.empty((len(c) + 1, *c.shape[1:]))
    out[:mu - d + 1] = c[:mu - d + 1]
    out[mu + 1:] = c[mu:]
    for j in range(mu - d + 1, mu + 1):
        part = (v - t[j]) / (t[j + d] - t[j])
        out[j] = (1 - part) * c[j - 1] + part * c[j]
    return np.insert(t, mu + 1, v), out


def run_scene(scene, fits, ways, seconds, folder):
    print(f"\n### {scene.name}\n\n{scene.text}: {len(scene.contours)} contours of degree {scene.degree}, "
          f"{sum(len(np.unique(c.t)) - 1 for c in scene.contours)} spans in all\n\n"
          "| way | degree | control points | time, ms | off the contours | wrong signs at places | of pairs | by the proof | "
          "of pairs |\n|---|---|---|---|---|---|---|---|---|", flush=True)
    rows, notes = [], []
    for way in ways:
        try:
            surface, note = way.build(scene, os.path.join(folder, "surface"), seconds)
            asked, broken, unproven = prove(fits, surface, os.path.join(folder, "proven"))
        except (RuntimeError, ValueError) as reason:
            notes.append(f"{way.label} failed: {reason}")
            continue
        except subprocess.TimeoutExpired:
            notes.append(f"{way.label}: over {LIMIT} s")
            continue
        pairs, wrong, off = violations(scene, surface)
        row = dict(scene=scene.name, way=way.label, degree_t=surface.degrees[0], degree_z=surface.degrees[1],
                   points=surface.control.shape[0] * surface.control.shape[1], seconds=surface.seconds,
                   builds=surface.builds, off=off, wrong=wrong, pairs=pairs, proof_wrong=broken,
                   proof_unproven=unproven, proof_pairs=asked)
        rows.append(row)
        print(f"| {way.label} | ({row['degree_t']}, {row['degree_z']}) | {row['points']} | {1e3 * surface.seconds:.3g} | "
              f"{off:.1e} | {wrong} | {pairs} | {broken}{f' and {unproven} unproven' if unproven else ''} | {asked} |",
              flush=True)
        if note:
            notes.append(f"{way.label} says: {note}")
    for note in notes:
        print("\n" + note)
    return rows


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--fits", required=True, help="loft-fits")
    options.add_argument("--sisl", default="", help="peer-sisl-skin")
    options.add_argument("--csv", default="")
    options.add_argument("--seconds", type=float, default=1, help="for the repeats of a build")
    options.add_argument("--only", default="", help="scenes whose name has one of these parts")
    o = options.parse_args()
    print(f"# Lofts: peers\n\nSciPy {scipy.__version__}{', SISL' if o.sisl else '; absent, left out: SISL'}; one thread")
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        written = subprocess.run([o.fits, "scenes", folder], check=True, capture_output=True, text=True).stdout
        for line in written.splitlines():
            name, text = line.split(" ", 1)
            if not o.only or any(part in name for part in o.only.split(",")):
                rows += run_scene(Scene(folder, name, text), o.fits, all_ways(o.fits, o.sisl), o.seconds, folder)
    if rows and o.csv:
        with open(o.csv, "w", newline="") as f:
            writer = csv.DictWriter(f, rows[0].keys())
            writer.writeheader()
            writer.writerows(rows)


main()

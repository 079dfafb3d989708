"""Curves through points of the plane by batten and by others, on the same points in the same run.

Ways by least squares have the same parameters and knots: they differ in time, by rounding, and by batten's tension.
Ways with a tolerance choose their knots themselves; those of batten have the wanted inflections too, and nobody
else's do. Times are medians of several fits on one thread."""
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
    from scipy import interpolate, spatial
except ImportError as missing:
    print(f"the benchmark of curves beside peers needs NumPy and SciPy ({missing}); nothing was run")
    sys.exit(0)

LIMIT = 120  # seconds a fit; what takes longer is said to
HEAD, CURVE_HEAD = 8, 5


class Scene:
    """As contour-fits wrote it."""

    def __init__(self, folder, name, text):
        self.name, self.text, self.path = name, text, os.path.join(folder, name + ".scene")
        numbers = np.fromfile(self.path)
        self.count, self.degree, self.smoothness, self.spans, inflections = (int(x) for x in numbers[:5])
        self.tolerance, self.size = numbers[6:8]
        sizes = np.cumsum([HEAD, self.count, 2 * self.count, 2 * self.count, self.spans + 1, inflections])
        self.parameters, points, truth, self.breaks, self.inflections = (
            numbers[a:b] for a, b in zip(sizes, sizes[1:]))
        self.points, self.truth = points.reshape(-1, 2), truth.reshape(-1, 2)
        self.inner = np.repeat(self.breaks[1:-1], self.degree - self.smoothness)
        ends = self.degree + 1
        self.knots = np.concatenate([np.zeros(ends), self.inner, np.ones(ends)])


class Result:
    def __init__(self, seconds, fits, proven, degree, knots, control):
        self.seconds, self.fits, self.proven, self.degree = seconds, int(fits), bool(proven), int(degree)
        self.spline = interpolate.BSpline(knots, control, self.degree)


# ---- The ways: each takes scene, file for the curve, seconds for its repeats ----

class Program:
    def __init__(self, label, own, program, *words):
        self.label, self.own, self.command = label, own, [program, *words]

    def fit(self, scene, path, seconds):
        run = subprocess.run([*self.command, scene.path, path, str(seconds)], capture_output=True, text=True,
                             timeout=LIMIT)
        if run.returncode:
            raise RuntimeError(run.stderr.strip().split("\n")[-1][:100] or f"ends with {run.returncode}")
        numbers = np.fromfile(path)
        knots = int(numbers[4])
        return Result(*numbers[:4], numbers[CURVE_HEAD:CURVE_HEAD + knots],
                      numbers[CURVE_HEAD + knots:].reshape(-1, 2)), run.stderr.strip()


class SciPy:
    def __init__(self, label, own, make):
        self.label, self.own, self.make = label, own, make

    def fit(self, scene, path, seconds):
        times, begin = [], time.perf_counter()
        while not times or len(times) < 25 and time.perf_counter() - begin < seconds:
            start = time.perf_counter()
            knots, control, degree = self.make(scene)
            times.append(time.perf_counter() - start)
        return Result(statistics.median(times), len(times), False, degree, knots, control), ""


def least_squares(scene):
    s = interpolate.make_lsq_spline(scene.parameters, scene.points, scene.knots, scene.degree)
    return s.t, s.c, s.k


def dierckx(scene):
    (t, c, k), _ = interpolate.splprep(scene.points.T, u=scene.parameters, ub=0, ue=1, k=scene.degree, task=-1,
                                       t=scene.knots)
    return t, np.stack(c, axis=1), k


def dierckx_tolerance(scene):
    """The sum of squares that points at a third of the tolerance would have."""
    s = scene.count * (scene.tolerance / 3) ** 2
    (t, c, k), _ = interpolate.splprep(scene.points.T, u=scene.parameters, ub=0, ue=1, k=scene.degree, s=s)
    return t, np.stack(c, axis=1), k


def all_ways(fits, sisl):
    ways = [Program("batten, least squares", True, fits, "fit", "least"),
            SciPy("SciPy make_lsq_spline", False, least_squares),
            SciPy("SciPy splprep, knots given (FITPACK)", False, dierckx),
            Program("batten, shape, one round", True, fits, "fit", "round"),
            Program("batten, shape, two rounds with corrections", True, fits, "fit", "shape"),
            Program("batten, shape, for the tolerance", True, fits, "fit", "tolerance"),
            SciPy("SciPy splprep, smoothing (FITPACK)", False, dierckx_tolerance)]
    if sisl:
        ways.append(Program("SISL s1961, for the tolerance", False, sisl))
    return ways


# ---- Figures ----

def inflections(spline):
    """Changes of sign of the curvature, at 16 places a span."""
    breaks = np.unique(spline.t)
    t = np.concatenate([np.linspace(a, b, 16, endpoint=False) for a, b in zip(breaks, breaks[1:])])
    first, second = spline(t, 1), spline(t, 2)
    curvature = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    size = np.linalg.norm(first, axis=1) * np.linalg.norm(second, axis=1)
    sign = np.sign(curvature[np.abs(curvature) > 1e-9 * size])
    return int(np.count_nonzero(sign[1:] != sign[:-1]))


def distances(spline, points):
    """To the curve: from the nearest of many places, by Newton's steps that do not lead away."""
    breaks = np.unique(spline.t)
    places = max(16, 4096 // len(breaks))
    samples = np.concatenate([np.linspace(a, b, places, endpoint=False) for a, b in zip(breaks, breaks[1:])])
    samples = np.append(samples, breaks[-1])
    t = samples[spatial.cKDTree(spline(samples)).query(points)[1]]
    off = np.sum((spline(t) - points) ** 2, axis=1)
    for _ in range(6):
        e, first, second = spline(t) - points, spline(t, 1), spline(t, 2)
        gauss = np.sum(first * first, axis=1)
        newton = gauss + np.sum(e * second, axis=1)
        step = np.sum(e * first, axis=1) / np.where(newton > 0.1 * gauss, newton, gauss)
        there = np.clip(t - step, breaks[0], breaks[-1])
        nearer = np.sum((spline(there) - points) ** 2, axis=1)
        t, off = np.where(nearer < off, there, t), np.minimum(off, nearer)
    return np.sqrt(off)


def figure(value):
    return "-" if not np.isfinite(value) else f"{value:.3g}"


def run_scene(scene, ways, seconds, folder):
    print(f"\n### {scene.name}\n\n{scene.text}: {scene.count} points, {scene.spans} spans where they are given, "
          f"{len(scene.inflections)} inflections, tolerance {figure(scene.tolerance)}\n\n"
          "| way | coefficients | time, ms | beside batten's least squares | rms | largest distance | off the truth, "
          "rms | inflections | proven |\n|---|---|---|---|---|---|---|---|---|", flush=True)
    rows, notes, base = [], [], None
    for way in ways:
        try:
            result, note = way.fit(scene, os.path.join(folder, "curve"), seconds)
        except (RuntimeError, ValueError) as reason:
            notes.append(f"{way.label} failed: {reason}")
            continue
        except subprocess.TimeoutExpired:
            notes.append(f"{way.label}: over {LIMIT} s")
            continue
        base = base or result.seconds
        off = distances(result.spline, scene.points)
        truth = distances(result.spline, scene.truth)
        row = dict(scene=scene.name, points=scene.count, way=way.label, coefficients=len(result.spline.c),
                   seconds=result.seconds, fits=result.fits, rms=np.sqrt(np.mean(off ** 2)), max_error=off.max(),
                   rms_truth=np.sqrt(np.mean(truth ** 2)), inflections=inflections(result.spline),
                   wanted=len(scene.inflections), proven="yes" if result.proven else "no")
        rows.append(row)
        print(f"| {way.label} | {row['coefficients']} | {1e3 * result.seconds:.3g} | {result.seconds / base:.2f} | "
              f"{figure(row['rms'])} | {figure(row['max_error'])} | {figure(row['rms_truth'])} | {row['inflections']} | "
              f"{row['proven'] if way.own else '-'} |", flush=True)
        if note:
            notes.append(f"{way.label} says: {note}")
    for note in notes:
        print("\n" + note)
    return rows


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--fits", required=True, help="contour-fits")
    options.add_argument("--sisl", default="", help="peer-sisl")
    options.add_argument("--csv", default="")
    options.add_argument("--seconds", type=float, default=1, help="for the repeats of a fit")
    options.add_argument("--only", default="", help="scenes whose name has one of these parts")
    o = options.parse_args()
    print(f"# Curves: peers\n\nSciPy {scipy.__version__}{', SISL' if o.sisl else '; absent, left out: SISL'}; one thread")
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        written = subprocess.run([o.fits, "scenes", folder], check=True, capture_output=True, text=True).stdout
        for line in written.splitlines():
            name, text = line.split(" ", 1)
            if not o.only or any(part in name for part in o.only.split(",")):
                rows += run_scene(Scene(folder, name, text), all_ways(o.fits, o.sisl), o.seconds, folder)
    if rows and o.csv:
        with open(o.csv, "w", newline="") as f:
            writer = csv.DictWriter(f, rows[0].keys())
            writer.writeheader()
            writer.writerows(rows)


main()

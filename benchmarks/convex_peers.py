"""batten's convex fits beside other people's unconstrained ones of the same points, all measured by the same code.

Usage: convex_peers.py --fits PROGRAM [--occt PROGRAM] [--csv FILE] [--seconds S] [--only PART,...]

  PROGRAM: convex-fits; peer-occt, built where Open CASCADE is (Debian: libocct-modeling-algorithms-dev)

Peers: SciPy's LSQBivariateSpline (z over the plane, the knots that batten has) and SmoothBivariateSpline (its own
knots, the smoothing that the noise asks for), Open CASCADE's plate through scattered points with a spline near it, and
its approximations of grids. What is absent is said and left out. Every result is a B-spline surface, and convex-fits
judges all: distances of the points from their nearest places, curvature over the rectangle that has the data, the proof
of convexity over all of the surface. Times are medians of several fits on one thread, from the points to the surface,
without its judgement; batten's contain its own measures and proof."""
import argparse
import csv
import os
import statistics
import subprocess
import sys
import tempfile
import time
import warnings

for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ[variable] = "1"

try:
    import numpy as np
    import scipy
    from scipy import interpolate
except ImportError as missing:
    print(f"the benchmark of convex surfaces beside peers needs NumPy and SciPy ({missing}); nothing was run")
    sys.exit(0)

LIMIT = 120  # seconds a fit; what takes longer is said to


class Scene:
    """As convex-fits wrote it."""

    def __init__(self, folder, name, text):
        self.name, self.text, self.path = name, text, os.path.join(folder, name + ".scene")
        numbers = np.fromfile(self.path)
        self.count, *self.shape = (int(x) for x in numbers[:5])
        self.degree, self.spans = self.shape[:2], self.shape[2:]
        self.noise, self.grid = numbers[5], numbers[6] > 0
        self.points = numbers[10:10 + 3 * self.count].reshape(-1, 3)


# ---- The ways: each takes scene, file for the surface, seconds for its repeats ----

class Program:
    def __init__(self, label, program, *words, takes=lambda scene: True):
        self.label, self.takes = label, takes
        self.command = [program, *words]

    def fit(self, scene, result, seconds):
        run = subprocess.run([*self.command, scene.path, result, str(seconds)], capture_output=True, text=True,
                             timeout=LIMIT)
        if run.returncode:
            raise RuntimeError(run.stderr.strip().split("\n")[-1][:80] or f"ends with {run.returncode}")
        return run.stderr.strip()


class Spline:
    """A spline z over the plane by SciPy; as a surface its x and y have the Greville abscissae for coefficients."""

    def __init__(self, label, make):
        self.label, self.make, self.takes = label, make, lambda scene: True

    def fit(self, scene, result, seconds):
        x, y, z = np.ascontiguousarray(scene.points.T)
        times, begin = [], time.perf_counter()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # what it thinks of its own fit is seen below
            while not times or len(times) < 25 and time.perf_counter() - begin < seconds:
                start = time.perf_counter()
                spline = self.make(scene, x, y, z)
                times.append(time.perf_counter() - start)
        knots, degree = spline.get_knots(), spline.degrees
        greville = [np.array([t[i + 1:i + d + 1].mean() for i in range(len(t) - d - 1)])
                    for t, d in zip(knots, degree)]
        control = np.stack([*np.meshgrid(*greville, indexing="ij"),
                            spline.get_coeffs().reshape(len(greville[0]), len(greville[1]))], axis=-1)
        np.concatenate([[statistics.median(times), len(times), *degree, *map(len, knots)], *knots,
                        control.ravel()]).astype(float).tofile(result)
        return ""


def least_squares(scene, x, y, z):
    inner = [np.linspace(c.min(), c.max(), s + 1)[1:-1] for c, s in zip((x, y), scene.spans)]
    return interpolate.LSQBivariateSpline(x, y, z, *inner, kx=scene.degree[0], ky=scene.degree[1])


def smooth(scene, x, y, z):
    return interpolate.SmoothBivariateSpline(x, y, z, w=np.full(len(x), 1 / scene.noise), kx=scene.degree[0],
                                             ky=scene.degree[1])


def all_ways(fits, occt):
    ways = [Program("batten, surface, unconstrained", fits, "fit", "unconstrained"),
            Program("batten, surface, convex", fits, "fit", "convex"),
            Program("batten, function, unconstrained", fits, "fit", "least-squares"),
            Program("batten, function, convex", fits, "fit", "function"),
            Spline("SciPy LSQBivariateSpline", least_squares), Spline("SciPy SmoothBivariateSpline", smooth)]
    if occt:
        ways += [Program("Open CASCADE plate", occt, "plate"),
                 Program("Open CASCADE grid", occt, "grid", takes=lambda scene: scene.grid),
                 Program("Open CASCADE grid, smooth", occt, "smooth", takes=lambda scene: scene.grid)]
    return ways


# ---- Tables ----

def figure(value):
    return "-" if not np.isfinite(value) else f"{value:.3g}" if abs(value) < 1e5 else f"{value:.1e}"


def milliseconds(seconds):
    return "-" if not np.isfinite(seconds) else f"{seconds * 1e3:.3g}"


def judge(fits, scene, result):
    run = subprocess.run([fits, "judge", scene.path, result], capture_output=True, text=True, timeout=LIMIT)
    if run.returncode:
        raise RuntimeError(run.stderr.strip()[:80])
    return [float(x) for x in run.stdout.split()]


def run_scene(scene, ways, fits, seconds, folder):
    print(f"\n### {scene.name}\n\n{scene.text}: {scene.count} points, noise "
          f"{figure(scene.noise)}; degree {scene.degree[0]}, {scene.spans[0]} x {scene.spans[1]} spans\n\n"
          "| way | coefficients | time, ms | rms | off the truth | K_min | K_max | proven convex |\n"
          "|---|---|---|---|---|---|---|---|", flush=True)
    rows, notes = [], []
    for way in ways:
        if not way.takes(scene):
            continue
        result = os.path.join(folder, "surface")
        try:
            note = way.fit(scene, result, seconds)
            n, rms, largest, truth, low, high, whole_low, whole_high, proven = judge(fits, scene, result)
        except (RuntimeError, ValueError) as reason:
            notes.append(f"{way.label} failed: {reason}")
            continue
        except subprocess.TimeoutExpired:
            notes.append(f"{way.label}: over {LIMIT} s")
            continue
        took, repeats = np.fromfile(result, count=2)
        proof = ["no", "to 1e-8", "yes"][int(proven)]
        rows.append(dict(scene=scene.name, points=scene.count, noise=scene.noise, way=way.label, coefficients=int(n),
                         seconds=took, fits=int(repeats), rms=rms, max_error=largest, rms_truth=truth, K_min=low,
                         K_max=high, K_min_whole=whole_low, K_max_whole=whole_high, proven=proof))
        print(f"| {way.label} | {int(n)} | {milliseconds(took)} | {figure(rms)} | {figure(truth)} | {figure(low)} | "
              f"{figure(high)} | {proof} |", flush=True)
        if note:
            notes.append(f"{way.label} says: {note}")
    for note in notes:
        print("\n" + note)
    return rows


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--fits", required=True, help="convex-fits")
    options.add_argument("--occt", default="", help="peer-occt")
    options.add_argument("--csv", default="")
    options.add_argument("--seconds", type=float, default=1, help="for the repeats of a fit")
    options.add_argument("--only", default="", help="scenes whose name has one of these parts")
    o = options.parse_args()
    print(f"# Convex surfaces: peers\n\nSciPy {scipy.__version__}"
          f"{', Open CASCADE' if o.occt else '; absent, left out: Open CASCADE'}; one thread")
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        written = subprocess.run([o.fits, "scenes", folder], check=True, capture_output=True, text=True).stdout
        for line in written.splitlines():
            name, text = line.split(" ", 1)
            if not o.only or any(part in name for part in o.only.split(",")):
                rows += run_scene(Scene(folder, name, text), all_ways(o.fits, o.occt), o.fits, o.seconds, folder)
    if rows and o.csv:
        with open(o.csv, "w", newline="") as f:
            writer = csv.DictWriter(f, rows[0].keys())
            writer.writeheader()
            writer.writerows(rows)


main()

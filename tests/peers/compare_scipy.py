"""Volume splines against scipy.interpolate.RBFInterpolator, an implementation of its own. Prints TAP.
Usage: compare_scipy.py PROGRAM      (PROGRAM: spline_values)"""
import subprocess
import sys

try:
    import numpy as np
    from scipy.interpolate import RBFInterpolator
except ImportError as missing:
    print("1..0 # SKIP", missing)
    sys.exit(0)

# n, m, SciPy's kernel, smoothing, N, allowed difference over the range of the values, accuracy of an iteration (0: factors)
CASES = [
    (3, 2, "linear", 0, 400, 1e-10, 0),
    (3, 2, "linear", 0.05, 400, 1e-10, 0),
    (3, 3, "cubic", 0, 300, 1e-8, 0),
    (2, 2, "thin_plate_spline", 0, 300, 1e-8, 0),
    (2, 2, "thin_plate_spline", 1e-3, 300, 1e-8, 0),
    (1, 2, "cubic", 0, 60, 1e-8, 0),
    (1, 1, "linear", 0, 60, 1e-10, 0),
    (3, 4, "quintic", 0, 100, 1e-5, 0),
    # More points than one exact level takes: local solves on two levels, and far sums by expansions.
    (3, 2, "linear", 0, 3200, 1e-6, 1e-7),
    (3, 2, "linear", 1e-3, 3200, 1e-6, 1e-7),
    (3, 3, "cubic", 0, 3200, 1e-6, 1e-7),
    (2, 2, "thin_plate_spline", 0, 3200, 1e-6, 1e-7),
]

failed = 0
for number, (n, m, kernel, smoothing, count, allowed, accuracy) in enumerate(CASES, 1):
    random = np.random.default_rng(number)
    points = random.uniform(-2, 5, (count, n))
    values = np.sin(points).sum(axis=1) + points[:, 0] ** 2
    at = random.uniform(-3, 6, (50 if accuracy == 0 else 1000, n))
    text = f"{n} {m} {smoothing!r} {accuracy!r} {count} {len(at)}\n"
    text += "\n".join(" ".join(map(repr, map(float, row))) for row in np.column_stack([points, values])) + "\n"
    text += "\n".join(" ".join(map(repr, map(float, row))) for row in at) + "\n"
    run = subprocess.run([sys.argv[1]], input=text, capture_output=True, text=True)
    ours = np.array([float(line) for line in run.stdout.split()])
    theirs = RBFInterpolator(points, values, kernel=kernel, degree=m - 1, smoothing=smoothing)(at)
    if run.returncode or len(ours) != len(theirs):
        difference = np.inf
        print("#", run.stderr.strip())
    else:
        difference = np.abs(ours - theirs).max() / (values.max() - values.min())
    ok = difference <= allowed
    failed += not ok
    print(f"{'ok' if ok else 'not ok'} {number} - n={n} m={m} {kernel} smoothing={smoothing} N={count}"
          f"{', by iteration' if accuracy else ''}: "
          f"difference {difference:.2e} of the range, allowed {allowed:g}")
print(f"1..{len(CASES)}")
sys.exit(failed > 0)

"""Points and derivatives of surfaces against tensor products of scipy.interpolate.BSpline. Prints TAP.
Usage: compare_surface.py PROGRAM      (PROGRAM: surface_values)"""
import subprocess
import sys

try:
    import numpy as np
    from scipy.interpolate import BSpline
except ImportError as missing:
    print("1..0 # SKIP", missing)
    sys.exit(0)

# degrees, spans, how often inner knots are there
CASES = [((1, 2), (3, 2), 1), ((3, 3), (1, 1), 1), ((3, 3), (5, 4), 1), ((4, 5), (3, 3), 2), ((9, 7), (2, 3), 3)]


def knots(random, degree, spans, fold):
    inner = np.sort(random.uniform(-1, 2, spans - 1)).repeat(min(fold, degree))
    return np.concatenate([[-1] * (degree + 1), inner, [2] * (degree + 1)])


def basis(t, degree, order, at):
    """Of all functions at all places."""
    count = len(t) - degree - 1
    return BSpline(t, np.eye(count), degree).derivative(order)(at) if order else BSpline(t, np.eye(count), degree)(at)


failed = 0
for number, (degrees, spans, fold) in enumerate(CASES, 1):
    random = np.random.default_rng(number)
    t = [knots(random, d, s, fold) for d, s in zip(degrees, spans)]
    shape = [len(k) - d - 1 for k, d in zip(t, degrees)]
    control = random.uniform(-3, 3, (*shape, 3))
    places = random.uniform(-1, 2, (200, 2))
    numbers = [*degrees, *map(len, t), len(places), *t[0], *t[1], *control.ravel(), *places.ravel()]
    run = subprocess.run([sys.argv[1]], input=" ".join(repr(x.item() if hasattr(x, "item") else x) for x in numbers),
                         capture_output=True, text=True)
    ours = np.array([[float(x) for x in line.split()] for line in run.stdout.splitlines()])
    theirs = []
    for i, j in [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)]:
        if i > degrees[0] or j > degrees[1]:
            theirs.append(np.zeros((len(places), 3)))
        else:
            u, v = basis(t[0], degrees[0], i, places[:, 0]), basis(t[1], degrees[1], j, places[:, 1])
            theirs.append(np.einsum("pi,pj,ijx->px", u, v, control))
    theirs = np.hstack(theirs)
    if run.returncode or ours.shape != theirs.shape:
        difference = np.inf
        print("#", run.stderr.strip())
    else:
        difference = (np.abs(ours - theirs).max(axis=0) / (1 + np.abs(theirs).max(axis=0))).max()
    ok = difference <= 1e-12
    failed += not ok
    print(f"{'ok' if ok else 'not ok'} {number} - degrees {degrees}, {spans} spans, inner knots {fold} fold: "
          f"difference {difference:.1e} of the largest, allowed 1e-12")
print(f"1..{len(CASES)}")
sys.exit(failed > 0)

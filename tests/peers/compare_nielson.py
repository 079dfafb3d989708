"""The linear network system over a plane against SciPy's CloughTocher2DInterpolator, whose gradients are Nielson's
minimum norm network. Prints TAP.
Usage: compare_nielson.py PROGRAM      (PROGRAM: network_gradients)"""
import subprocess
import sys

try:
    import numpy as np
    from scipy.interpolate import CloughTocher2DInterpolator
    from scipy.spatial import Delaunay
except ImportError as missing:
    print("1..0 # SKIP", missing)
    sys.exit(0)

FUNCTIONS = [
    ("sin(3 x + y) cos(2 y)", lambda x, y: np.sin(3 * x + y) * np.cos(2 * y)),
    ("exp(x y)", lambda x, y: np.exp(x * y)),
    ("noise", lambda x, y: np.random.default_rng(7).normal(size=len(x))),
    ("3 x - 2 y + 1", lambda x, y: 3 * x - 2 * y + 1),
]

number = failed = 0
for count in (4, 30, 1000):
    points = np.random.default_rng(count).uniform(-1, 1, (count, 2))
    mesh = Delaunay(points)
    triangles = mesh.simplices.copy()
    a, b, c = (points[triangles[:, k]] for k in range(3))
    turned = np.cross(b - a, c - a) < 0
    triangles[turned] = triangles[turned][:, ::-1]
    for name, function in FUNCTIONS:
        number += 1
        values = function(points[:, 0], points[:, 1])
        theirs = CloughTocher2DInterpolator(mesh, values, tol=1e-15, maxiter=100000).grad.reshape(count, 2)
        text = f"{count} {len(triangles)}\n"
        text += "\n".join(" ".join(map(repr, map(float, row))) for row in np.column_stack([points, values])) + "\n"
        text += "\n".join(" ".join(map(str, row)) for row in triangles) + "\n"
        run = subprocess.run([sys.argv[1]], input=text, capture_output=True, text=True)
        ours = np.array([float(word) for word in run.stdout.split()])
        if run.returncode or len(ours) != 2 * count:
            difference = np.inf
            print("#", run.stderr.strip())
        else:
            difference = np.abs(ours.reshape(count, 2) - theirs).max() / np.abs(theirs).max()
        ok = difference <= 1e-8
        failed += not ok
        print(f"{'ok' if ok else 'not ok'} {number} - {count} points, {name}: gradients differ by {difference:.2e} "
              f"of the largest, allowed 1e-8")
print(f"1..{number}")
sys.exit(failed > 0)

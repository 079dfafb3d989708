"""Least squares and convex spline functions against SciPy. Prints TAP.
Usage: compare_convex.py PROGRAM      (PROGRAM: convex_values)

Without inequalities: LSQBivariateSpline with the same knots has the same coefficients. With them: two quadratic
programs of our own making, solved through SciPy's non-negative least squares, hold the best convex spline from both
sides. From above: on parts of the square the Bernstein matrices of the Hessian, found by interpolation, lie in a
polygonal cone of P directions: what it finds is convex. From below: z' H(x, y) z >= 0 at a grid of places in P
directions, which any convex spline fulfils. So no bound that batten claims to have proven may be above the first, and
nothing that it claims to be convex below the second."""
import subprocess
import sys

try:
    import numpy as np
    from scipy.interpolate import BSpline, LSQBivariateSpline
    from scipy.optimize import nnls
    from scipy.special import comb
except ImportError as missing:
    print("1..0 # SKIP", missing)
    sys.exit(0)

GAP = 1e-3
FUNCTIONS = {
    "bowl": lambda x, y: x * x + y * y / 2,
    "saddle": lambda x, y: x * x - y * y,
    "cone": np.hypot,
    "ridge": lambda x, y: np.abs(x + y),
    "wave": lambda x, y: np.sin(3 * x) + y * y * x,
}
# function, degrees, spans, points, noise
CASES = [("bowl", (3, 3), (3, 4), 400, 0.1), ("cone", (5, 4), (2, 3), 600, 0.05), ("wave", (2, 5), (6, 1), 300, 0.2),
         ("bowl", (2, 2), (1, 1), 40, 0.5), ("saddle", (2, 2), (1, 1), 40, 0.1), ("ridge", (3, 3), (1, 1), 60, 0.05),
         ("wave", (3, 2), (1, 1), 60, 0.1), ("saddle", (2, 3), (2, 1), 80, 0.1), ("cone", (3, 3), (2, 2), 120, 0.1)]


def knots(degree, spans):
    return np.concatenate([[-1] * degree, np.linspace(-1, 1, spans + 1), [1] * degree])


def basis(t, degree, order, at):
    """The functions' derivatives, [places][functions]."""
    b = BSpline(t, np.eye(len(t) - degree - 1), degree)
    return (b.derivative(order) if order else b)(at)


def directions(count):
    angles = np.pi * np.arange(count + 1) / count
    return np.stack([np.cos(angles), np.sin(angles)])


def forms(hessians, z, w):
    """z' H w of many H = (xx, xy, yy), each linear in the coefficients: [pairs][H][coefficients]."""
    xx, xy, yy = hessians
    return (np.multiply.outer(z[0] * w[0], xx) + np.multiply.outer(z[0] * w[1] + z[1] * w[0], xy) +
            np.multiply.outer(z[1] * w[1], yy)).reshape(-1, xx.shape[1])


def hessians_at(t, degrees, places):
    """(f_xx, f_xy, f_yy) at a grid of places, each [places][coefficients]."""
    return [np.einsum("pi,qj->pqij", basis(t[0], degrees[0], i, places[0]),
                      basis(t[1], degrees[1], j, places[1])).reshape(len(places[0]) * len(places[1]), -1)
            for i, j in [(2, 0), (1, 1), (0, 2)]]


def bernstein(degree):
    """Values at degree + 1 places inside (0, 1), and what takes such values to Bernstein coefficients."""
    at = (1 - np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1))) / 2
    k = np.arange(degree + 1)
    return at, np.linalg.inv(comb(degree, k) * at[:, None] ** k * (1 - at[:, None]) ** (degree - k))


def rows_above(t, degrees, spans, parts, count):
    """Sufficient rows, on parts x parts boxes of each span pair."""
    rules = [bernstein(d) for d in degrees]
    edges = [np.linspace(-1, 1, s * parts + 1) for s in spans]
    z, rows = directions(count), []
    for a, b in zip(edges[0], edges[0][1:]):
        for c, d in zip(edges[1], edges[1][1:]):
            values = hessians_at(t, degrees, (a + (b - a) * rules[0][0], c + (d - c) * rules[1][0]))
            change = np.kron(rules[0][1], rules[1][1])
            rows.append(forms([change @ h for h in values], z[:, :-1], z[:, 1:]))
    return np.concatenate(rows)


def rows_below(t, degrees, places, count):
    z = directions(count)[:, :-1]
    at = np.linspace(-1, 1, places)
    return forms(hessians_at(t, degrees, (at, at)), z, z)


def least_squares(a, b, rows):
    """min |a x - b|^2 with rows x >= 0: as a least distance problem [Lawson, Hanson 1974, chapter 23]."""
    q, r = np.linalg.qr(a)
    start = q.T @ b
    g = np.linalg.solve(r.T, rows.T).T
    lengths = np.linalg.norm(g, axis=1)
    g = g[lengths > 1e-12 * lengths.max()] / lengths[lengths > 1e-12 * lengths.max(), None]
    h = -g @ start
    if h.max() <= 0:
        return np.linalg.solve(r, start)
    e = np.vstack([g.T, h])
    f = np.append(np.zeros(len(start)), 1.0)
    u, _ = nnls(e, f, maxiter=20 * e.shape[1])
    residual = e @ u - f
    return np.linalg.solve(r, start - residual[:-1] / residual[-1])


count, failed = 0, 0


def check(ok, text):
    global count, failed
    count += 1
    failed += not ok
    print(f"{'ok' if ok else 'not ok'} {count} - {text}", flush=True)


def fit(degrees, spans, rounds, points):
    numbers = [*degrees, *spans, GAP, rounds, len(points), *points.ravel()]
    run = subprocess.run([sys.argv[1]], input=" ".join(repr(getattr(x, "item", lambda x=x: x)()) for x in numbers),
                         capture_output=True, text=True)
    if run.returncode:
        print("#", run.stderr.strip())
        return None
    return [np.array([float(x) for x in line.split()]) for line in run.stdout.splitlines()]


def compare(number, name, degrees, spans, size, noise):
    random = np.random.default_rng(number)
    points = random.uniform(-1, 1, (size, 3))
    points[:, 2] = FUNCTIONS[name](points[:, 0], points[:, 1]) + noise * random.standard_normal(size)
    label = f"{name}, degrees {degrees}, {spans} spans, {size} points: "
    small = (degrees[0] + spans[0]) * (degrees[1] + spans[1]) <= 30
    answer = fit(degrees, spans, 12 if small else 2, points)
    if answer is None:
        return check(False, label + "no answer")
    (status, objective, lower, lsq, lsq_lower, certified), free, convex = answer
    t = [knots(d, s) for d, s in zip(degrees, spans)]
    peer = LSQBivariateSpline(*points.T, t[0][degrees[0] + 1:-degrees[0] - 1], t[1][degrees[1] + 1:-degrees[1] - 1],
                              bbox=[-1, 1, -1, 1], kx=degrees[0], ky=degrees[1], eps=1e-14)
    off = np.abs(peer.get_coeffs() - free).max() / np.abs(free).max()
    check(off <= 1e-8, label + f"unconstrained coefficients off by {off:.1e}, allowed 1e-8")

    a = np.einsum("pi,pj->pij", basis(t[0], degrees[0], 0, points[:, 0]),
                  basis(t[1], degrees[1], 0, points[:, 1])).reshape(size, -1)
    def squares(x):
        return np.sum((a @ x - points[:, 2]) ** 2)
    off = max(abs(squares(convex) / lsq - 1), abs(objective / lsq * size - 1))
    check(off <= 1e-10 and certified, label + f"certified, sum of squares off by {off:.1e}")
    if not small:
        return None
    x = least_squares(a, points[:, 2], rows_below(t, degrees, 25, 48))
    below = squares(x)
    check(lsq >= below * (1 - 1e-9), label + f"{lsq:.8g} is not below {below:.8g} of necessary rows")
    best = np.inf
    for parts, fan in [(1, 4), (1, 16), (3, 16), (4, 32)]:
        rows = rows_above(t, degrees, spans, parts, fan)
        x = least_squares(a, points[:, 2], rows)
        violated = -(rows @ x).min() / np.abs(rows).max()
        if violated > 1e-9:
            return check(False, label + f"the peer's rows are violated by {violated:.1e}")
        best = min(best, squares(x))
    check(lsq_lower <= best * (1 + 1e-9) and lower * size <= best * (1 + 1e-9),
          label + f"nor is the lower bound {lsq_lower:.8g} above {best:.8g} of sufficient rows")
    check(status > 0 or lsq <= best * (1 + GAP), label + f"within {GAP} of the peer's best: {lsq / best - 1:+.1e}")
    return None


for index, case in enumerate(CASES, 1):
    compare(index, *case)
print(f"1..{count}")
sys.exit(failed > 0)

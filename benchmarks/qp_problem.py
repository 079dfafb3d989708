"""Quadratic programs for the benchmarks in Python: where they come from, and the judge that all solvers share.

    minimise 1/2 x'P x + q'x + constant   subject to   lower <= C x <= upper,  x_lower <= x <= x_upper

P and C are NumPy arrays or SciPy CSC/CSR matrices. Multipliers are numbered rows first, then bounds, with
gradient = C'y_rows + y_bounds: y > 0 presses from a lower side, y < 0 from an upper one."""
import os

import numpy as np
import scipy.io
import scipy.sparse as sparse

INFINITE = 9e19  # the collection writes 1e20 for no bound


class Problem:
    def __init__(self, name, P, q, C, lower, upper, x_lower=None, x_upper=None, constant=0.0, fit=None, family=""):
        n = len(q)
        self.name, self.P, self.q, self.C, self.constant, self.family = name, P, q, C, constant, family
        self.lower, self.upper = lower, upper
        self.x_lower = np.full(n, -np.inf) if x_lower is None else x_lower
        self.x_upper = np.full(n, np.inf) if x_upper is None else x_upper
        self.fit = fit  # (A, b) with P = A'A, q = -A'b, where the problem is a least squares one
        self.n, self.m = n, len(lower)
        self.sparse = sparse.issparse(C) or sparse.issparse(P)
        self._one_sided = None

    @property
    def bounded(self):
        return bool(np.isfinite(self.x_lower).any() or np.isfinite(self.x_upper).any())

    def dense(self):
        """P, C as arrays."""
        return tuple(m.toarray() if sparse.issparse(m) else m for m in (self.P, self.C))

    def one_sided(self):
        """(E, e, G, h, back): E x = e, G x >= h, bounds among them; back(y_E, y_G) gives multipliers of the problem."""
        if self._one_sided is None:
            rows = sparse.vstack([sparse.csr_matrix(self.C), sparse.eye(self.n)], format="csr") if self.sparse \
                else (np.vstack([self.C, np.eye(self.n)]) if self.bounded else self.C)
            count = rows.shape[0]
            low = np.concatenate([self.lower, self.x_lower])[:count]
            high = np.concatenate([self.upper, self.x_upper])[:count]
            equal = np.flatnonzero(low == high)
            lows = np.flatnonzero(np.isfinite(low) & (low != high))
            highs = np.flatnonzero(np.isfinite(high) & (low != high))
            stack = sparse.vstack if self.sparse else np.vstack
            G = rows[lows] if not len(highs) else stack([rows[lows], -rows[highs]])

            def back(y_equal, y_sides):
                y = np.zeros(self.m + self.n)
                y[equal] = y_equal
                y[lows] += y_sides[:len(lows)]
                y[highs] -= y_sides[len(lows):]
                return y

            self._one_sided = rows[equal], low[equal], G, np.concatenate([low[lows], -high[highs]]), back
        return self._one_sided


def _wide(matrix):
    return matrix.astype(np.longdouble)


def judge(p, x, y):
    """Largest violation, largest stationarity residual, duality gap: absolute, in extended precision, from the problem's
    own numbers. A multiplier that presses from a side without bound counts as a dual residual."""
    if x is None or y is None or not np.isfinite(x).all() or not np.isfinite(y).all():
        return np.inf, np.inf, np.inf
    X, Y = x.astype(np.longdouble), y.astype(np.longdouble)
    low = np.concatenate([p.lower, p.x_lower]).astype(np.longdouble)
    high = np.concatenate([p.upper, p.x_upper]).astype(np.longdouble)
    C = _wide(p.C)
    values = np.concatenate([C @ X, X])
    primal = max(0, (low - values).max(initial=0), (values - high).max(initial=0))
    side = np.where(Y > 0, low, high)
    pressing = (Y != 0) & np.isfinite(side)
    lost = np.abs(Y[(Y != 0) & ~np.isfinite(side)]).max(initial=0)
    Px = _wide(p.P) @ X
    dual = max(lost, np.abs(Px + p.q - C.T @ Y[:p.m] - Y[p.m:]).max(initial=0))
    gap = abs(X @ Px + p.q.astype(np.longdouble) @ X - (Y[pressing] * side[pressing]).sum())
    return float(primal), float(dual), float(gap)


def collection(folder, name):
    """A Maros-Meszaros problem of a folder of .mat files; the last n rows of A are those of the unit matrix."""
    f = scipy.io.loadmat(os.path.join(folder, name + ".mat"))
    q = f["q"].ravel().astype(float)
    n, A = len(q), sparse.csr_matrix(f["A"].astype(float))
    low, high = f["l"].ravel().astype(float), f["u"].ravel().astype(float)
    low[low < -INFINITE], high[high > INFINITE] = -np.inf, np.inf
    m = A.shape[0] - n
    P = sparse.csc_matrix(f["P"].astype(float))
    return Problem(name, P, q, A[:m], low[:m], high[:m], low[m:], high[m:], float(f["r"].ravel()[0]),
                   family="collection")


def scene(path):
    """A problem that qp_problems.c wrote, all in doubles: n; the matrices A, H, C as rows, columns, entries (-1: dense) and
    then values, or starts, columns and values; the vectors b, g, lower, upper, x_lower, x_upper as length and values."""
    data, at = np.fromfile(path), 0

    def take(count):
        nonlocal at
        at += int(count)
        return data[at - int(count):at]

    def matrix():
        rows, columns, entries = (int(v) for v in take(3))
        if rows == 0:
            return None
        if entries < 0:
            return take(rows * columns).reshape(rows, columns).copy()
        starts = take(rows + 1).astype(int)
        where = take(entries).astype(int)
        return sparse.csr_matrix((take(entries), where, starts), shape=(rows, columns))

    n = int(take(1)[0])
    A, H, C = matrix(), matrix(), matrix()
    b, g, lower, upper, x_lower, x_upper = (v if len(v) else None for v in (take(take(1)[0]) for _ in range(6)))
    m = 0 if C is None else C.shape[0]
    P, q = (H if H is not None else 0), (np.zeros(n) if g is None else g)
    if A is not None:
        P, q = A.T @ A + P, q - A.T @ (np.zeros(A.shape[0]) if b is None else b)
    if sparse.issparse(P):
        P = sparse.csc_matrix(P) if sparse.issparse(C) else P.toarray()
    name = os.path.basename(path).split(".")[0]
    return Problem(name, P, q, np.zeros((0, n)) if C is None else C,
                   np.full(m, -np.inf) if lower is None else lower, np.full(m, np.inf) if upper is None else upper,
                   x_lower, x_upper, fit=None if A is None or H is not None or g is not None else (A, b),
                   family=name.split("-")[0])

"""Solvers behind one face, for qp_peers.py: each takes a qp_problem.Problem and a tolerance, and hands back a function that
solves once from the problem in the solver's own format (that conversion is not timed) and what turns its answer into
(claim, x, multipliers). Multipliers: rows first, then bounds; gradient = C'y_rows + y_bounds."""
import ctypes
import importlib
import importlib.metadata
import os
import shutil
import struct
import subprocess
import tempfile

import numpy as np
import scipy.sparse as sparse

FINITE = 1e20  # no bound, for solvers that want a number


def _none(matrix):
    return matrix if matrix.shape[0] else None


class Solver:
    """sizes: the largest n that is worth trying (dense solvers), and whether sparse problems are taken as they are."""
    label, package, largest = "", "", np.inf

    def missing(self):
        """Why it cannot be used; None when it can."""
        try:
            self.module = importlib.import_module(self.package)
        except Exception as reason:  # a broken wheel may raise anything
            return str(reason)
        return None

    def version(self):
        try:
            return importlib.metadata.version(self.package)
        except importlib.metadata.PackageNotFoundError:
            return "?"

    def takes(self, p):
        return p.n <= self.largest

    def prepare(self, p, eps):
        """(solve, answer): solve() -> raw; answer(raw) -> (claim, x, y)."""
        raise NotImplementedError


class Quadprog(Solver):
    """Goldfarb-Idnani, dense."""
    label, package, largest = "quadprog", "quadprog", 1500

    def prepare(self, p, eps):
        P, _ = p.dense()
        E, e, G, h, back = p.one_sided()
        dense = [m.toarray() if sparse.issparse(m) else m for m in (E, G)]
        Ct, b, meq = np.ascontiguousarray(np.vstack(dense).T), np.concatenate([e, h]), len(e)

        def answer(raw):
            x, y = raw[0], raw[4].copy()
            if meq:  # it hides the signs of the equalities' multipliers
                rest = P @ x + p.q - Ct[:, meq:] @ y[meq:]
                y[:meq] = np.copysign(y[:meq], np.linalg.lstsq(Ct[:, :meq], rest, rcond=None)[0])
            return True, x, back(y[:meq], y[meq:])

        return lambda: self.module.solve_qp(P, -p.q, Ct, b, meq), answer


class Daqp(Solver):
    """Dual active set in C, dense."""
    label, package, largest = "daqp", "daqp", 1500

    def prepare(self, p, eps):
        P, C = (np.ascontiguousarray(m) for m in p.dense())
        low = np.concatenate([p.x_lower, p.lower] if p.bounded else [p.lower])
        high = np.concatenate([p.x_upper, p.upper] if p.bounded else [p.upper])
        sense = np.where(low == high, 5, 0).astype(np.int32)
        low, high = np.maximum(low, -1e30), np.minimum(high, 1e30)
        bounds = p.n if p.bounded else 0

        def answer(raw):
            x, _, flag, info = raw
            y = -np.asarray(info["lam"])
            return flag == 1, np.asarray(x), np.concatenate([y[bounds:], y[:bounds], np.zeros(p.n - bounds)])

        return lambda: self.module.solve(P, p.q, C, high.copy(), low.copy(), sense.copy(), primal_tol=eps, dual_tol=eps,
                                         iter_limit=100000), answer


class Piqp(Solver):
    """Proximal interior point, dense and sparse."""
    label, package = "piqp", "piqp"

    def prepare(self, p, eps):
        equal = np.flatnonzero(p.lower == p.upper)
        other = np.flatnonzero(p.lower != p.upper)
        convert = (lambda m: sparse.csc_matrix(m)) if p.sparse else np.asfortranarray
        P, A, G = convert(p.P), convert(p.C[equal]), convert(p.C[other])
        kind = self.module.SparseSolver if p.sparse else self.module.DenseSolver

        def solve():
            s = kind()
            s.settings.eps_abs, s.settings.eps_rel = eps, 0
            s.settings.check_duality_gap = True
            s.settings.eps_duality_gap_abs, s.settings.eps_duality_gap_rel = eps, 0
            s.setup(P, p.q, _none(A), p.lower[equal] if len(equal) else None, _none(G),
                    p.lower[other] if len(other) else None, p.upper[other] if len(other) else None,
                    p.x_lower if p.bounded else None, p.x_upper if p.bounded else None)
            return s.solve(), s

        def answer(raw):
            status, r = raw[0], raw[1].result
            y = np.zeros(p.m + p.n)
            y[equal] = -np.asarray(r.y)
            if len(other):
                y[other] = np.asarray(r.z_l) - np.asarray(r.z_u)
            if p.bounded:
                y[p.m:] = np.asarray(r.z_bl) - np.asarray(r.z_bu)
            return status == self.module.PIQP_SOLVED, np.asarray(r.x), y

        return solve, answer


class Osqp(Solver):
    """Operator splitting."""
    label, package = "osqp", "osqp"

    def prepare(self, p, eps):
        rows = sparse.csc_matrix(sparse.vstack([sparse.csc_matrix(p.C), sparse.eye(p.n)]) if p.bounded else p.C)
        low = np.concatenate([p.lower, p.x_lower])[:rows.shape[0]]
        high = np.concatenate([p.upper, p.x_upper])[:rows.shape[0]]
        P = sparse.csc_matrix(sparse.triu(p.P))

        def solve():
            s = self.module.OSQP()
            s.setup(P=P, q=p.q, A=rows, l=low, u=high, eps_abs=eps, eps_rel=0, verbose=False, polishing=True,
                    max_iter=1000000, check_dualgap=True, time_limit=100.0)
            return s.solve(raise_error=False)

        def answer(r):
            y = np.zeros(p.m + p.n)
            if r.y is not None:
                y[:len(r.y)] = -np.asarray(r.y, float)
            return r.info.status == "solved", np.asarray(r.x, float), y

        return solve, answer


class Clarabel(Solver):
    """Interior point on the homogeneous embedding, sparse."""
    label, package = "clarabel", "clarabel"

    def prepare(self, p, eps):
        E, e, G, h, back = p.one_sided()
        A = sparse.vstack([sparse.csc_matrix(E), -sparse.csc_matrix(G)], format="csc")
        b = np.concatenate([e, -h])
        cones = [self.module.ZeroConeT(len(e)), self.module.NonnegativeConeT(len(h))]
        P = sparse.csc_matrix(sparse.triu(p.P))
        settings = self.module.DefaultSettings()
        settings.verbose, settings.max_threads = False, 1
        settings.tol_feas, settings.tol_gap_abs, settings.tol_gap_rel = eps, eps, 0.0

        def answer(r):
            z = np.asarray(r.z)
            return str(r.status) == "Solved", np.asarray(r.x), back(-z[:len(e)], z[len(e):])

        return lambda: self.module.DefaultSolver(P, p.q, A, b, cones, settings).solve(), answer


class Proxqp(Solver):
    """Proximal augmented Lagrangian, dense and sparse."""
    label, package = "proxqp", "proxsuite"

    def prepare(self, p, eps):
        kinds = self.module.proxqp
        equal = np.flatnonzero(p.lower == p.upper)
        other = np.flatnonzero(p.lower != p.upper)
        dense = not p.sparse
        rows, low, high = p.C[other], p.lower[other], p.upper[other]
        if not dense and p.bounded:  # its sparse form has no bounds
            rows = sparse.vstack([rows, sparse.eye(p.n)], format="csc")
            low, high = np.concatenate([low, p.x_lower]), np.concatenate([high, p.x_upper])
        low, high = np.maximum(low, -FINITE), np.minimum(high, FINITE)
        convert = np.ascontiguousarray if dense else sparse.csc_matrix
        P, A, G, b = convert(p.P), convert(p.C[equal]), convert(rows), p.lower[equal]
        box = dense and p.bounded

        def solve():
            s = kinds.dense.QP(p.n, len(equal), len(other), box) if dense else \
                kinds.sparse.QP(p.n, len(equal), rows.shape[0])
            s.settings.eps_abs, s.settings.eps_rel = eps, 0
            s.settings.check_duality_gap = True
            s.settings.eps_duality_gap_abs, s.settings.eps_duality_gap_rel = eps, 0
            s.settings.max_iter = 10000
            if box:
                s.init(P, p.q, A, b, G, low, high, np.maximum(p.x_lower, -FINITE), np.minimum(p.x_upper, FINITE))
            else:
                s.init(P, p.q, A, b, G, low, high)
            s.solve()
            return s

        def answer(s):
            y = np.zeros(p.m + p.n)
            z = -np.asarray(s.results.z)
            y[equal], y[other] = -np.asarray(s.results.y), z[:len(other)]
            if p.bounded:
                y[p.m:] = z[len(other):]
            return "SOLVED" in str(s.results.info.status) and "CLOSEST" not in str(s.results.info.status), \
                np.asarray(s.results.x), y

        return solve, answer


class Cvxopt(Solver):
    """Interior point in Python on LAPACK."""
    label, package = "cvxopt", "cvxopt"

    def takes(self, p):
        return p.n * p.m <= 2e6 or p.sparse

    def prepare(self, p, eps):
        solvers = importlib.import_module("cvxopt.solvers")
        matrix, spmatrix = self.module.matrix, self.module.spmatrix
        E, e, G, h, back = p.one_sided()

        def convert(m):
            if not sparse.issparse(m):
                return matrix(np.ascontiguousarray(m))
            m = sparse.coo_matrix(m)
            return spmatrix(m.data.tolist(), m.row.tolist(), m.col.tolist(), m.shape)

        options = dict(show_progress=False, feastol=eps, abstol=eps, reltol=1e-200, maxiters=200)
        args = [convert(p.P), matrix(p.q), convert(-G), matrix(-h)]
        if len(e):
            args += [convert(E), matrix(e)]

        def answer(r):
            y = np.asarray(r["y"]).ravel() if len(e) else np.zeros(0)
            return r["status"] == "optimal", np.asarray(r["x"]).ravel(), back(-y, np.asarray(r["z"]).ravel())

        return lambda: solvers.qp(*args, options=options), answer


class Program(Solver):
    """A solver in another language, run as a program: PROBLEM holds doubles n, equalities, rows, repeats, P and G by
    columns with their vectors q and h after each; RESULT: median seconds, claim, x, multipliers of the rows. Its own clock counts."""
    largest = 1100
    repeats = 3

    def command(self):
        """Of the program; [] where it is absent."""
        raise NotImplementedError

    def missing(self):
        return None if self.command() else "not installed"

    def prepare(self, p, eps):
        P, _ = p.dense()
        E, e, G, h, back = p.one_sided()
        rows = np.vstack([m.toarray() if sparse.issparse(m) else m for m in (E, G)])
        head = struct.pack("4d", p.n, len(e), len(rows), self.repeats)
        content = head + b"".join(np.asarray(a, float).tobytes(order="F") for a in (P, p.q, rows, np.concatenate([e, h])))

        def solve():
            with tempfile.TemporaryDirectory() as folder:
                paths = [os.path.join(folder, name) for name in ("problem", "result")]
                with open(paths[0], "wb") as f:
                    f.write(content)
                subprocess.run(self.command() + paths, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
                return np.fromfile(paths[1])

        def answer(raw):
            x, y = raw[2:2 + p.n], raw[2 + p.n:].copy()
            if len(e):  # R's quadprog hides the signs of the equalities' multipliers
                rest = P @ x + p.q - rows[len(e):].T @ y[len(e):]
                y[:len(e)] = np.linalg.lstsq(rows[:len(e)].T, rest, rcond=None)[0]
            return raw[1] > 0, x, back(y[:len(e)], y[len(e):])

        return solve, answer


class RQuadprog(Program):
    label = "quadprog (R)"

    def command(self):
        script = os.path.join(os.path.dirname(__file__), "peer_quadprog.R")
        program = shutil.which("Rscript")
        if not program or subprocess.run([program, "-e", "library(quadprog)"], capture_output=True).returncode:
            return []
        type(self).command = lambda _: [program, script]
        return [program, script]

    def version(self):
        return subprocess.run(self.command()[:1] + ["-e", "cat(as.character(packageVersion('quadprog')))"],
                              capture_output=True, text=True).stdout


class OctaveQp(Program):
    label = "qp (Octave)"

    def command(self):
        program = shutil.which("octave-cli")
        script = os.path.join(os.path.dirname(__file__), "peer_qp.m")
        return [program, "--no-init-file", "--no-history", script] if program else []

    def version(self):
        return subprocess.run(self.command()[:1] + ["--eval", "disp(version)"], capture_output=True,
                              text=True).stdout.strip()


class Alglib(Program):
    label = "ALGLIB IPM"

    def __init__(self, program):
        self.program = program

    def command(self):
        return [self.program] if self.program else []

    def version(self):
        return "of the system"


# ---- batten, through ctypes: the structs of <batten/matrix.h> and <batten/qp.h> ----

_doubles, _size = ctypes.POINTER(ctypes.c_double), ctypes.c_size_t


class _Matrix(ctypes.Structure):
    _fields_ = [("rows", _size), ("columns", _size), ("dense", _doubles), ("starts", ctypes.POINTER(_size)),
                ("indices", ctypes.POINTER(ctypes.c_uint32)), ("values", _doubles)]


class _Problem(ctypes.Structure):
    _fields_ = [("struct_size", _size), ("n", _size), ("a", ctypes.POINTER(_Matrix)), ("b", _doubles),
                ("weights", _doubles), ("h", ctypes.POINTER(_Matrix)), ("g", _doubles), ("constant", ctypes.c_double),
                ("c", ctypes.POINTER(_Matrix)), ("lower", _doubles), ("upper", _doubles), ("x_lower", _doubles),
                ("x_upper", _doubles)]


class _Options(ctypes.Structure):
    _fields_ = [("struct_size", _size), ("engine", ctypes.c_int), ("tolerance_absolute", ctypes.c_double),
                ("tolerance_relative", ctypes.c_double), ("iteration_limit", _size), ("time_limit_s", ctypes.c_double),
                ("x0", _doubles), ("active", ctypes.c_void_p), ("hand_over", ctypes.c_int), ("exact", ctypes.c_int),
                ("interior", _doubles)]


class _Solution(ctypes.Structure):
    _fields_ = [("x", _doubles), ("multipliers", _doubles), ("active", ctypes.c_void_p), ("certificate", _doubles),
                ("ray", _doubles)]


class _Info(ctypes.Structure):
    _fields_ = [("engine", ctypes.c_int)] + \
        [(name, ctypes.c_double) for name in ("objective", "primal_residual", "dual_residual", "duality_gap",
                                              "primal_scale", "dual_scale", "gap_scale")] + \
        [(name, _size) for name in ("iterations", "factorizations", "proximal_steps", "rows_used", "rows_active",
                                    "not_convex_index")] + \
        [(name, ctypes.c_double) for name in ("blend", "time_setup_s", "time_solve_s", "time_s")]


class Batten(Solver):
    """engine 0 = by estimated cost; fit: the least squares matrix instead of its Hessian, where the problem has one."""

    def __init__(self, library, engine=0, label="batten", fit=False):
        self.library, self.engine, self.label, self.fit = library, engine, label, fit

    def missing(self):
        try:
            b = self.b = ctypes.CDLL(self.library)
            b.batten_qp_problem_default.restype, b.batten_qp_problem_default.argtypes = _Problem, [_size]
            b.batten_qp_options_default.restype = _Options
            b.batten_version.restype = b.batten_error.restype = ctypes.c_char_p
            b.batten_error.argtypes = [ctypes.c_void_p]
            b.batten_qp_solve.argtypes = [ctypes.c_void_p] * 6
            b.batten_qp_workspace_new.argtypes = [ctypes.c_void_p] * 2
            for struct_, size in ((_Problem, b.batten_qp_problem_default(1).struct_size),
                                  (_Options, b.batten_qp_options_default().struct_size)):
                if ctypes.sizeof(struct_) != size:
                    return f"{struct_.__name__[1:]} of <batten/qp.h> has {size} bytes, this script knows " \
                           f"{ctypes.sizeof(struct_)}"
        except (OSError, AttributeError) as reason:
            return str(reason)
        return None

    def version(self):
        return self.b.batten_version().decode()

    def takes(self, p):
        return self.fit is False or p.fit is not None

    def prepare(self, p, eps):
        keep = []

        def doubles(array):
            array = np.ascontiguousarray(array, float)
            keep.append(array)
            return array.ctypes.data_as(_doubles)

        def matrix(m):
            if sparse.issparse(m):
                m = sparse.csr_matrix(m)
                starts, columns = m.indptr.astype(np.uintp), m.indices.astype(np.uint32)
                keep.extend([starts, columns])
                out = _Matrix(*m.shape, None, starts.ctypes.data_as(ctypes.POINTER(_size)),
                              columns.ctypes.data_as(ctypes.POINTER(ctypes.c_uint32)), doubles(m.data))
            else:
                out = _Matrix(*m.shape, doubles(m), None, None, None)
            return ctypes.pointer(out)

        b = self.b
        problem, options, info = b.batten_qp_problem_default(p.n), b.batten_qp_options_default(), _Info()
        if self.fit:
            problem.a, problem.b = matrix(p.fit[0]), doubles(p.fit[1])
        else:
            problem.h, problem.g = matrix(p.P), doubles(p.q)
        problem.constant = p.constant
        problem.c, problem.lower, problem.upper = matrix(p.C), doubles(p.lower), doubles(p.upper)
        if p.bounded:
            problem.x_lower, problem.x_upper = doubles(p.x_lower), doubles(p.x_upper)
        options.engine, options.tolerance_absolute, options.tolerance_relative = self.engine, eps, 0.0
        x, y = np.full(p.n, np.nan), np.full(p.m + p.n, np.nan)
        solution = _Solution(doubles(x), doubles(y), None, None, None)
        ctx = ctypes.c_void_p()
        if b.batten_context_new(None, ctypes.byref(ctx)) < 0:
            raise MemoryError
        keep.extend([problem, options, info, solution, x, y, ctx])
        self.info, self.context = info, ctx

        def solve():
            return b.batten_qp_solve(ctx, ctypes.byref(problem), ctypes.byref(options), None, ctypes.byref(solution),
                                     ctypes.byref(info))

        return solve, lambda status, keep=keep: (status == 0, x, y)


def all_solvers(library, alglib):
    ours = [Batten(library), Batten(library, 1, "batten primal"), Batten(library, 2, "batten dual"),
            Batten(library, 3, "batten interior"), Batten(library, 0, "batten (A, b)", fit=True)] if library else []
    return ours + [Quadprog(), Daqp(), Piqp(), Osqp(), Clarabel(), Proxqp(), Cvxopt(), RQuadprog(), OctaveQp(),
                   Alglib(alglib)]

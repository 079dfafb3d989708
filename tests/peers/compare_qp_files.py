"""Quadratic programs in files, against SciPy's reader and writer of MATLAB's files, and against HiGHS's of MPS and QPS
where Python has it (highspy). Prints TAP.
Usage: compare_qp_files.py PROGRAM      (PROGRAM: convert_qp FROM TO)
The problems of the shared collection are read where it is there (environment BATTEN_SHARED)."""
import glob
import json
import os
import subprocess
import sys
import tempfile
import time

try:
    import highspy
except ImportError:
    highspy = None
try:
    import numpy as np
    import scipy.io
    import scipy.sparse as sp
except ImportError as missing:
    print("1..0 # SKIP", missing)
    sys.exit(0)

program = sys.argv[1]
failed = 0
count = 0


def check(ok, what):
    global failed, count
    count += 1
    failed += not ok
    print(f"{'ok' if ok else 'not ok'} {count} - {what}", flush=True)


def convert(source, target):
    run = subprocess.run([program, source, target], capture_output=True, text=True)
    return run.stderr.strip() if run.returncode else ""


def matrix(value, shape):
    """A matrix of a document, without entries that are 0."""
    if value is None:
        return sp.csr_matrix(shape)
    if isinstance(value, dict):
        return sp.csr_matrix((value["values"], (value["rows"], value["cols"])), shape=shape)
    return sp.csr_matrix(np.array(value, float).reshape(shape))


def side(values, count, none):
    return np.array([none if v is None else v for v in values or [None] * count], float)


def same(a, b):
    """The same entries to the bit."""
    a, b = sp.csr_matrix(a, dtype=float), sp.csr_matrix(b, dtype=float)
    for m in (a, b):
        m.eliminate_zeros()
        m.sort_indices()
    return (a.shape == b.shape and np.array_equal(a.indptr, b.indptr) and np.array_equal(a.indices, b.indices)
            and np.array_equal(a.data, b.data))


def differs(problem, document):
    """What of P q r l u A the document has otherwise; '' for nothing."""
    A = sp.csr_matrix(problem["A"], dtype=float)
    n = A.shape[1]
    lower = np.ravel(problem["l"]).astype(float)
    upper = np.ravel(problem["u"]).astype(float)
    lower[lower <= -9e19] = -np.inf
    upper[upper >= 9e19] = np.inf
    bounds = A.shape[0] >= n and same(A[A.shape[0] - n:], sp.eye(n))
    m = A.shape[0] - n if bounds else A.shape[0]
    wrong = []
    if document["n"] != n:
        wrong.append("n")
    if not same(problem["P"], matrix(document.get("H"), (n, n))):
        wrong.append("P")
    if not same(A[:m], matrix(document.get("C"), (m, n))):
        wrong.append("A")
    if not np.array_equal(np.ravel(problem["q"]).astype(float), np.array(document["g"], float)):
        wrong.append("q")
    if float(np.ravel(problem["r"])[0]) != document["constant"]:
        wrong.append("r")
    if not np.array_equal(lower[:m], side(document.get("lower"), m, -np.inf)):
        wrong.append("l")
    if not np.array_equal(upper[:m], side(document.get("upper"), m, np.inf)):
        wrong.append("u")
    if bounds and not (np.array_equal(lower[m:], side(document.get("x_lower"), n, -np.inf))
                       and np.array_equal(upper[m:], side(document.get("x_upper"), n, np.inf))):
        wrong.append("bounds")
    return " ".join(wrong)


def random_problem(rng, n, m, bounds):
    F = sp.random(n, n, 0.3, random_state=rng, format="csc")
    A = sp.random(m, n, 0.4, random_state=rng, format="csc")
    if bounds:
        A = sp.vstack([A, sp.eye(n)], format="csc")
    lower = rng.standard_normal(A.shape[0])
    lower[rng.random(A.shape[0]) < 0.3] = -1e20
    upper = lower + rng.random(A.shape[0])
    upper[rng.random(A.shape[0]) < 0.3] = 1e20
    return {"P": (F @ F.T).tocsc(), "q": rng.standard_normal((n, 1)), "r": 3.25, "l": lower.reshape(-1, 1),
            "u": upper.reshape(-1, 1), "A": A, "n": n, "m": A.shape[0]}


def highs_differs(path, document):
    """What HiGHS reads otherwise from a QPS file; '' for nothing."""
    highs = highspy.Highs()
    highs.setOptionValue("output_flag", False)
    if highs.readModel(path) != highspy.HighsStatus.kOk:
        return "refused"
    model = highs.getModel()
    lp, hessian = model.lp_, model.hessian_
    n, m = document["n"], len(document.get("lower", []))
    format_of = sp.csc_matrix if lp.a_matrix_.format_ == highspy.MatrixFormat.kColwise else sp.csr_matrix
    C = format_of((lp.a_matrix_.value_, lp.a_matrix_.index_, lp.a_matrix_.start_), shape=(m, n))
    H = sp.tril(matrix(document.get("H"), (n, n)))
    theirs = sp.csr_matrix((n, n)) if hessian.dim_ == 0 else sp.csc_matrix(
        (hessian.value_, hessian.index_, hessian.start_), shape=(n, n))
    pairs = {
        "C": same(C, matrix(document.get("C"), (m, n))),
        "H": same(theirs, H),
        "g": np.array_equal(lp.col_cost_, document["g"]),
        "constant": lp.offset_ == document["constant"],
        "lower": np.array_equal(lp.row_lower_, side(document.get("lower"), m, -np.inf)),
        "upper": np.array_equal(lp.row_upper_, side(document.get("upper"), m, np.inf)),
        "x_lower": np.array_equal(lp.col_lower_, side(document.get("x_lower"), n, -np.inf)),
        "x_upper": np.array_equal(lp.col_upper_, side(document.get("x_upper"), n, np.inf)),
    }
    return " ".join(name for name, equal in pairs.items() if not equal)


def whole_document(rng, n, m):
    """A document in small whole numbers, which no sum rounds, with sides of every kind; HiGHS writes no free rows."""
    C = rng.integers(-4, 5, (m, n))
    C[:, 0] = 1  # no empty row
    F = rng.integers(-2, 3, (n, n))
    lower = [None if rng.random() < 0.3 else int(v) for v in rng.integers(-9, 9, m)]
    upper = [9 if low is None else None if rng.random() < 0.3 else low + int(rng.integers(0, 3)) for low in lower]
    x_lower = [None if rng.random() < 0.4 else int(v) for v in rng.integers(-2, 2, n)]
    x_upper = [None if rng.random() < 0.4 else (-1 if low is None else low + int(rng.integers(0, 3))) for low in x_lower]
    return {"batten": "qp", "version": 1, "n": n, "H": (F @ F.T).tolist(), "g": rng.integers(-5, 6, n).tolist(),
            "constant": int(rng.integers(-9, 9)), "C": C.tolist(), "lower": lower, "upper": upper, "x_lower": x_lower,
            "x_upper": x_upper}


with tempfile.TemporaryDirectory() as folder:
    rng = np.random.default_rng(7)
    for compressed in (False, True):
        for n, m, bounds in ((1, 1, True), (7, 12, False), (40, 25, True)):
            problem = random_problem(rng, n, m, bounds)
            source, target = os.path.join(folder, "a.mat"), os.path.join(folder, "a.json")
            scipy.io.savemat(source, problem, do_compression=compressed, oned_as="column")
            error = convert(source, target)
            wrong = error or differs(problem, json.load(open(target)))
            form = "compressed" if compressed else "plain"
            check(not wrong, f"SciPy writes {n} unknowns, {problem['A'].shape[0]} rows, {form} {wrong}")
            dense = dict(problem, P=problem["P"].toarray(), A=problem["A"].toarray())
            scipy.io.savemat(source, dense, do_compression=compressed)
            error = convert(source, target)
            wrong = error or differs(problem, json.load(open(target)))
            check(not wrong, f"the same with full matrices {wrong}")

    if not highspy:
        check(True, "QPS read and written by HiGHS # SKIP highspy is not there")
    for n, m in ((3, 4), (12, 20), (30, 11)) if highspy else ():
        document = whole_document(rng, n, m)
        paths = [os.path.join(folder, name) for name in ("w.json", "w.mps", "highs.mps", "back.json")]
        with open(paths[0], "w") as file:
            json.dump(document, file)
        wrong = convert(paths[0], paths[1]) or highs_differs(paths[1], document)
        check(not wrong, f"HiGHS reads what is written: {n} unknowns, {m} rows {wrong}")
        highs = highspy.Highs()
        highs.setOptionValue("output_flag", False)
        highs.readModel(paths[1])
        highs.writeModel(paths[2])
        wrong = convert(paths[2], paths[3])
        back = {} if wrong else json.load(open(paths[3]))
        for key in ("g", "constant", "lower", "upper", "x_lower", "x_upper") if back else ():
            wrong += "" if back[key] == document[key] else key + " "
        if back and not (same(matrix(back["H"], (n, n)), matrix(document["H"], (n, n)))
                         and same(matrix(back["C"], (m, n)), matrix(document["C"], (m, n)))):
            wrong += "H or C"
        check(not wrong, f"what HiGHS writes is read {wrong}")

    files = sorted(glob.glob(os.path.join(os.environ.get("BATTEN_SHARED", "../shared"), "data", "qp", "*.mat")))
    if not files:
        check(True, "the shared collection # SKIP it is not there")
    bad, entries, seconds = [], 0, 0.0
    for source in files:
        target = os.path.join(folder, "b.json")
        problem = scipy.io.loadmat(source)
        entries += problem["P"].nnz + problem["A"].nnz
        begin = time.time()
        error = convert(source, target)
        seconds += time.time() - begin
        wrong = error or differs(problem, json.load(open(target)))
        if wrong:
            bad.append(f"{os.path.basename(source)}: {wrong}")
    if files:
        check(not bad, f"{len(files)} problems, {entries} entries read and written in {seconds:.2f} s {'; '.join(bad)}")
print(f"1..{count}")
sys.exit(failed > 0)

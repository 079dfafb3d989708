"""batten and other people's solvers on the same quadratic programs, to the same tolerance, in one run and on one thread.

Usage: qp_peers.py [--batten LIBBATTEN.so] [--problems PROGRAM] [--alglib PROGRAM] [--csv FILE] [--picture FILE]
                   [--collection some|dense|all] [--limit S] [--only PART,...] [--solvers PART,...]

  pip install quadprog daqp piqp osqp clarabel proxsuite cvxopt       (the peers; Debian: python3-cvxopt,
  r-cran-quadprog with r-base-core, octave, and libalglib-dev when batten is built, for the others)

What is absent is said and left out. Times are medians of several solves from the problem in each solver's own format (its
conversion is not counted, its factorisations are); residuals are absolute, recomputed for all in extended precision
from the problem's own numbers (qp_problem.judge); "solved" means that primal, dual and gap are <= the tolerance. What is
not solved within the limit counts as the limit."""
import argparse
import csv
import itertools
import multiprocessing
import os
import signal
import statistics
import subprocess
import sys
import tempfile
import time

for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

try:
    import numpy as np
    import scipy.sparse as sparse

    import qp_picture
    import qp_problem
    import qp_solvers
except ImportError as missing:
    print(f"the benchmark of quadratic programs beside peers needs NumPy and SciPy ({missing}); nothing was run")
    sys.exit(0)

COLLECTION = ["KSIP", "LASER", "LISWET1", "LISWET6", "LISWET12", "DUAL1", "DUAL4", "DUALC1", "QPCBOEI1", "QPCSTAIR",
              "CVXQP1_S", "PRIMAL1", "STADAT1", "AUG3DCQP"]


# ---- Running one solver on one problem ----

def child(connection, solver, p, eps, budget):
    os.setsid()  # what it starts ends with it
    try:
        solve, answer = solver.prepare(p, eps)
        times = []
        began = time.perf_counter()
        while True:
            start = time.perf_counter()
            raw = solve()
            times.append(time.perf_counter() - start)
            if len(times) >= 25 or time.perf_counter() - began > budget or isinstance(solver, qp_solvers.Program):
                break
        if isinstance(solver, qp_solvers.Program):
            times = [raw[0]]
        claim, x, y = answer(raw)
        connection.send((statistics.median(times), bool(claim), x, y))
    except subprocess.CalledProcessError:
        connection.send((None, False, None, "its program failed"))
    except Exception as reason:  # whatever a solver throws is a failure of that solver
        connection.send((None, False, None, str(reason).strip().split("\n")[-1][:80]))


def measure(solver, p, eps, limit, budget):
    """(seconds, claim, primal, dual, gap, note)"""
    ours, theirs = multiprocessing.Pipe(False)
    process = multiprocessing.get_context("fork").Process(target=child, args=(theirs, solver, p, eps, budget))
    process.start()
    theirs.close()
    seconds, claim, x, y, note = limit, False, None, None, ""
    try:
        if ours.poll(limit * (3 if isinstance(solver, qp_solvers.Program) else 1) + budget + 5):
            seconds, claim, x, y = ours.recv()
            if seconds is None:
                seconds, note, y = limit, y, None
        else:
            note = "time"
    except EOFError:
        note = "crashed"
    try:
        os.killpg(process.pid, signal.SIGKILL)
    except ProcessLookupError:
        pass
    process.join()
    return (seconds, claim, *qp_problem.judge(p, x, y), note)


# ---- Problems ----

def from_program(program, folder):
    """The shape and banded problems of tests/qp_scenes.h, written by qp_problems.c: all solvers, and the benchmark in C,
    get the same numbers."""
    subprocess.run([program, folder], check=True, stdout=subprocess.DEVNULL)
    return [qp_problem.scene(os.path.join(folder, name)) for name in sorted(os.listdir(folder))]


def of_collection(folder, which):
    """Names of the files of the collection: a selection, those that count as dense, or all."""
    if not os.path.isdir(folder):
        print(f"\n(no Maros-Meszaros problems in {folder})")
        return
    for file in sorted(os.listdir(folder)):
        name = file[:-4]
        if file.endswith(".mat") and (which != "some" or name in COLLECTION):
            p = qp_problem.collection(folder, name)
            if which != "dense" or p.n <= 1000 and p.m <= 1000:
                yield p


# ---- Tables ----

def figure(seconds):
    return f"{seconds * 1e3:.3g} ms" if seconds < 1 else f"{seconds:.3g} s"


def run_problem(p, solvers, eps, limit, budget):
    print(f"\n### {p.name}: {p.n} unknowns, {p.m} rows" + (", bounds" if p.bounded else "") + "\n")
    print("| solver | time | solved | primal | dual | gap |\n|---|---|---|---|---|---|", flush=True)
    rows = []
    for solver in solvers:
        if not solver.takes(p):
            continue
        seconds, claim, primal, dual, gap, note = measure(solver, p, eps, limit, budget)
        solved = max(primal, dual, gap) <= eps
        text = "yes" if solved and claim else "yes, not claimed" if solved else "claimed, wrongly" if claim else "no"
        if note:
            text = f"no ({note})"
        rows.append(dict(problem=p.name, family=p.family, n=p.n, m=p.m, solver=solver.label, seconds=seconds,
                         claimed=int(claim), solved=int(solved), primal=primal, dual=dual, gap=gap, note=note))
        print(f"| {solver.label} | {figure(seconds)} | {text} | {primal:.1e} | {dual:.1e} | {gap:.1e} |", flush=True)
    return rows


def summary(rows, limit):
    """Solved by each solver, and the shifted geometric mean of its times, failures at the limit. A solver is counted on
    what it was given; a dense one is not given large problems."""
    print("\n### All problems\n\n| solver | given | solved | claims that hold | shifted geometric mean (shift 10 s) | (shift 10 ms) |"
          "\n|---|---|---|---|---|---|")
    for label in dict.fromkeys(r["solver"] for r in rows):
        own = [r for r in rows if r["solver"] == label]
        times = [r["seconds"] if r["solved"] else limit for r in own]
        means = [statistics.geometric_mean([t + s for t in times]) - s for s in (10, 0.01)]
        print(f"| {label} | {len(own)} | {sum(r['solved'] for r in own)} | "
              f"{sum(r['solved'] == r['claimed'] for r in own)} | {figure(means[0])} | {figure(means[1])} |")


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--batten", default="", help="libbatten.so")
    options.add_argument("--problems", default="", help="the program that writes the shape and banded problems")
    options.add_argument("--alglib", default="", help="the program that times ALGLIB")
    options.add_argument("--data", default=os.path.join(os.environ.get("BATTEN_SHARED", ""), "data", "qp"))
    options.add_argument("--collection", choices=["some", "dense", "all"], default="some", help="Maros-Meszaros problems")
    options.add_argument("--csv", default="")
    options.add_argument("--picture", default="", help=".svg of time against rows")
    options.add_argument("--tolerance", type=float, default=1e-9)
    options.add_argument("--limit", type=float, default=20, help="seconds a solve")
    options.add_argument("--budget", type=float, default=1, help="seconds for the repeats of a solve")
    options.add_argument("--only", default="", help="problems whose name has one of these parts")
    options.add_argument("--solvers", default="", help="solvers whose name has one of these parts")
    o = options.parse_args()

    def chosen(name, parts):
        return not parts or any(part in name for part in parts.split(","))

    solvers, absent = [], []
    for solver in qp_solvers.all_solvers(o.batten, o.alglib):
        if chosen(solver.label, o.solvers):
            reason = solver.missing()
            absent.append(f"{solver.label} ({reason})") if reason else solvers.append(solver)
    print("# Quadratic programs beside peers\n\nOne thread, tolerance", o.tolerance, "absolute;",
          ", ".join(f"{s.label} {s.version()}" for s in solvers))
    if absent:
        print("\nAbsent, left out:", "; ".join(absent))
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for p in itertools.chain(from_program(o.problems, folder) if o.problems else [],
                                 of_collection(o.data, o.collection)):
            if chosen(p.name, o.only):
                rows += run_problem(p, solvers, o.tolerance, o.limit, o.budget)
    if not rows:
        return
    summary(rows, o.limit)
    if o.csv:
        with open(o.csv, "w", newline="") as f:
            writer = csv.DictWriter(f, rows[0].keys())
            writer.writeheader()
            writer.writerows(rows)
    if o.picture:
        qp_picture.write(o.picture, [r for r in rows if r["family"] == "patch" and not r["solver"].startswith("batten ")])


main()

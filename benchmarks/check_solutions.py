"""The residuals of batten's answers to the Maros-Meszaros problems by an independent road: each .mat is read by SciPy and
judged in extended precision with the x and multipliers of the JSON files that `maros-meszaros --solutions FOLDER` wrote.
Usage: check_solutions.py DATA SOLUTIONS [TOLERANCE]       Ends with status 1 when what is claimed does not hold."""
import json
import os
import sys

import numpy as np

import qp_problem

data, folder = sys.argv[1:3]
tolerance = float(sys.argv[3]) if len(sys.argv) > 3 else 1e-9
claimed = held = wrong = 0
print("| name | status | primal | dual | gap | holds |\n|---|---|---|---|---|---|")
for name in sorted(os.listdir(folder)):
    name = name.split(".")[0]
    with open(os.path.join(folder, name + ".json")) as f:
        answer = json.load(f)
    p = qp_problem.collection(data, name)
    x, y = (np.array(answer[key], float) for key in ("x", "multipliers"))
    residuals = qp_problem.judge(p, x, y)
    claim, holds = answer["status"] == "optimal", max(residuals) <= tolerance
    claimed, held, wrong = claimed + claim, held + (claim and holds), wrong + (claim and not holds)
    print(f"| {name} | {answer['status']} | " + " | ".join(f"{r:.1e}" for r in residuals) +
          f" | {'yes' if holds else 'no' if not claim else '**claimed, and no**'} |")
print(f"\n{claimed} claimed at {tolerance:g}, {held} hold, {wrong} do not")
sys.exit(wrong > 0)

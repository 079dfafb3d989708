#!/usr/bin/python3
"""Counts the results of meson's testlog.json: a TAP line is one result, a test without TAP is one result.

Usage: tally.py TESTLOG   prints "PASSED FAILED SKIPPED", then the log of each test that failed.
"""
import json
import re
import sys


def count(test):
    """(passed, failed, skipped) of one test."""
    lines = re.findall(r"^(ok|not ok)\b(.*)$", test.get("stdout", ""), re.M)
    skipped = sum(1 for ok, text in lines if ok == "ok" and re.search(r"#\s*skip", text, re.I))
    passed = sum(1 for ok, _ in lines if ok == "ok") - skipped
    failed = len(lines) - passed - skipped
    result = test["result"]
    if result in ("OK", "EXPECTEDFAIL"):
        passed += not lines
    elif result == "SKIP":
        skipped += not lines
    elif failed == 0:  # crashed, timed out, or said less than it planned
        failed = 1
    return passed, failed, skipped


def main():
    totals = [0, 0, 0]
    logs = []
    with open(sys.argv[1], encoding="utf-8", errors="replace") as log:
        for line in log:
            test = json.loads(line)
            counts = count(test)
            totals = [a + b for a, b in zip(totals, counts)]
            if counts[1]:
                logs.append(test)
    print(*totals)
    for test in logs:
        print(f"---- {test['name']}: {test['result']}, exit status {test.get('returncode')}, "
              f"{test.get('duration', 0):.1f} s")
        shown = [line for line in test.get("stdout", "").splitlines() if not line.startswith("ok ")]
        print("\n".join(shown[-80:]))
        if test.get("stderr"):
            print("\n".join(test["stderr"].splitlines()[-80:]))


if __name__ == "__main__":
    main()

#!/usr/bin/python3
"""Compiles the C of the documentation; prints TAP.

Every block that opens with ```c in a Markdown file is tried:
  a block with main()      is a program: compiled, linked, run in a scratch folder; it has to return 0
  a block with #include    is a file: compiled
  any other block          is the body of a function that has a context `ctx`, points [count][3] and normals: compiled
Warnings are errors, but for names that a fragment leaves unused.

Usage: snippets.py --cc "CC" --include DIR ... --library FILE ... FILE.md|FOLDER ...
"""
import argparse
import glob
import os
import re
import shlex
import subprocess
import sys
import tempfile

BODY = """#include <batten/batten.h>
#include <batten/exchange.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
batten_status snippet(batten_context *ctx, size_t count, const double *points, const double *normals);
batten_status snippet(batten_context *ctx, size_t count, const double *points, const double *normals) {
  batten_status st = BATTEN_OK;
%s
  return st;
}
"""


def pages(paths):
    """The files named, and the Markdown files of the folders named."""
    for path in paths:
        yield from sorted(glob.glob(os.path.join(path, "*.md"))) if os.path.isdir(path) else [path]


def blocks(path):
    """(line number, text) of each C block."""
    with open(path, encoding="utf-8") as file:
        text = file.read()
    for match in re.finditer(r"^```c\n(.*?)^```$", text, re.M | re.S):
        yield text.count("\n", 0, match.start()) + 2, match.group(1)


def run(command, where, timeout=60):
    """Error text of a command, empty when it succeeds."""
    done = subprocess.run(command, cwd=where, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          timeout=timeout, check=False)
    return "" if done.returncode == 0 else f"exit status {done.returncode}\n{done.stdout}"


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--cc", required=True)
    parser.add_argument("--include", action="append", default=[])
    parser.add_argument("--library", action="append", default=[])
    parser.add_argument("paths", nargs="*")
    options = parser.parse_args()
    compile_command = shlex.split(options.cc) + ["-std=c11", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-Wno-unused",
                                                 "-Wno-unused-parameter"]
    compile_command += [f"-I{folder}" for folder in options.include]
    libraries = [os.path.abspath(library) for library in options.library]
    libraries += [f"-Wl,-rpath,{os.path.dirname(library)}" for library in libraries] + ["-lm"]

    count = 0
    failed = False
    for path in pages(options.paths):
        for line, text in blocks(path):
            count += 1
            program = "int main(" in text
            with tempfile.TemporaryDirectory() as scratch:
                source = os.path.join(scratch, "snippet.c")
                with open(source, "w", encoding="utf-8") as file:
                    file.write(text if program or "#include" in text else BODY % text)
                if program:
                    error = run(compile_command + [source, "-o", source + ".out"] + libraries, scratch)
                    error = error or run([source + ".out"], scratch)
                else:
                    error = run(compile_command + ["-fsyntax-only", source], scratch)
            failed = failed or bool(error)
            kind = "builds and runs" if program else "compiles"
            print(f"{'not ok' if error else 'ok'} {count} - {os.path.basename(path)}:{line} {kind}")
            for row in error.splitlines():
                print("#", row)
    print(f"1..{count}")
    return failed


if __name__ == "__main__":
    sys.exit(main())

"""Mesh files that batten writes, read by meshio. Prints TAP.
Usage: compare_meshio.py PROGRAM FOLDER      (PROGRAM: write_meshes; it writes octahedron.* into FOLDER)"""
import os
import subprocess
import sys
import tempfile

try:
    import meshio
    import numpy as np
except ImportError as missing:
    print("1..0 # SKIP", missing)
    sys.exit(0)

failed = 0
count = 0


def check(ok, what):
    global failed, count
    count += 1
    failed += not ok
    print(f"{'ok' if ok else 'not ok'} {count} - {what}")


with tempfile.TemporaryDirectory() as folder:
    run = subprocess.run([sys.argv[1], folder], capture_output=True, text=True)
    check(run.returncode == 0, f"meshes written {run.stderr.strip()}")
    for extension in ("ply", "obj", "stl", "off", "vtu"):
        path = os.path.join(folder, "octahedron." + extension)
        try:
            mesh = meshio.read(path)
        except (SystemExit, Exception) as error:  # meshio's readers exit on what they refuse
            check(False, f"{extension}: {error}")
            continue
        points = np.asarray(mesh.points, float)
        triangles = np.vstack([block.data for block in mesh.cells if block.type == "triangle"])
        a, b, c = (points[triangles[:, k]] for k in range(3))
        volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
        tolerance = 1e-6 if extension == "stl" else 1e-14
        check(len(triangles) == 8 and abs(volume - 8) <= 8 * tolerance, f"{extension}: 8 triangles, volume {volume!r}")
        if extension == "vtu":
            height = mesh.point_data.get("height")
            check(height is not None and np.array_equal(np.ravel(height), points[:, 2]), "vtu: the field comes back to the bit")
print(f"1..{count}")
sys.exit(failed > 0)

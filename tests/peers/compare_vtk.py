"""Surfaces that batten writes as .vtu, .vtp, .vtk and .ply, read by VTK. Prints TAP.
Usage: compare_vtk.py PROGRAM      (PROGRAM: write_surfaces)"""
import os
import subprocess
import sys
import tempfile

try:
    import numpy as np
    import vtk
    from vtk.util.numpy_support import vtk_to_numpy
except ImportError as missing:
    print("1..0 # SKIP", missing)
    sys.exit(0)

VTK_BEZIER_QUADRILATERAL = 77
failed = 0
count = 0


def check(ok, what):
    global failed, count
    count += 1
    failed += not ok
    print(f"{'ok' if ok else 'not ok'} {count} - {what}")


def read(reader, path):
    reader.SetFileName(path)
    reader.Update()
    return reader.GetOutput()


def worst_of_cells(grid, places):
    """Largest distance between the points of the Bezier cells and those that batten evaluated, over the size."""
    domains = vtk_to_numpy(grid.GetCellData().GetArray("domain"))
    worst = 0
    for u, v, *rest in places:
        cells = np.nonzero((domains[:, 0] <= u) & (u <= domains[:, 1]) & (domains[:, 2] <= v) & (v <= domains[:, 3]))[0]
        cell = grid.GetCell(int(cells[0]))
        u0, u1, v0, v1 = domains[cells[0]]
        at, weights = [0.0] * 3, [0.0] * cell.GetNumberOfPoints()
        cell.EvaluateLocation(vtk.reference(0), [(u - u0) / (u1 - u0), (v - v0) / (v1 - v0), 0], at, weights)
        worst = max(worst, np.abs(np.subtract(at, rest[:3])).max())
    return worst / np.abs(places[:, 2:5]).max()


with tempfile.TemporaryDirectory() as folder:
    run = subprocess.run([sys.argv[1], folder], capture_output=True, text=True)
    check(run.returncode == 0, f"surfaces written {run.stderr.strip()}")
    for line in run.stdout.splitlines():
        name, p, q, cells = line.split()
        path = os.path.join(folder, name)
        places = np.loadtxt(path + ".places")
        grid = read(vtk.vtkXMLUnstructuredGridReader(), path + ".vtu")
        types = {grid.GetCellType(i) for i in range(grid.GetNumberOfCells())}
        degrees = {tuple(grid.GetCell(i).GetOrder(k) for k in range(2)) for i in range(grid.GetNumberOfCells())}
        check(
            types == {VTK_BEZIER_QUADRILATERAL} and degrees == {(int(p), int(q))} and grid.GetNumberOfCells() == int(cells),
            f"{name}.vtu: {grid.GetNumberOfCells()} Bezier quadrilaterals of degree {p} x {q}",
        )
        worst = worst_of_cells(grid, places)
        check(worst <= 1e-14, f"{name}.vtu: points at {len(places)} places within {worst:.2g} of the size")
        mesh = read(vtk.vtkXMLPolyDataReader(), path + ".vtp")
        ply = read(vtk.vtkPLYReader(), path + ".ply")
        data = mesh.GetPointData()
        shapes = {data.GetArrayName(i): data.GetArray(i).GetNumberOfComponents() for i in range(data.GetNumberOfArrays())}
        check(shapes == {"gauss": 1, "mean": 1, "normal": 3, "place": 2}, f"{name}.vtp: fields {shapes}")
        points = vtk_to_numpy(mesh.GetPoints().GetData())
        legacy = read(vtk.vtkPolyDataReader(), path + ".vtk")
        check(
            np.array_equal(points, vtk_to_numpy(legacy.GetPoints().GetData()))
            and np.array_equal(
                vtk_to_numpy(mesh.GetPolys().GetConnectivityArray()),
                vtk_to_numpy(legacy.GetPolys().GetConnectivityArray()),
            )
            and all(
                np.array_equal(vtk_to_numpy(data.GetArray(key)), vtk_to_numpy(legacy.GetPointData().GetArray(key)), True)
                for key in shapes
            ),
            f"{name}.vtk: the same points, triangles and fields as .vtp",
        )
        others = vtk_to_numpy(ply.GetPoints().GetData())  # VTK's reader keeps single precision
        same = points.shape == others.shape and np.abs(points - others).max() <= 1e-6 * np.abs(points).max()
        check(same and mesh.GetNumberOfPolys() == ply.GetNumberOfPolys() == 2 * 16 * 16 * int(cells),
              f"{name}: {mesh.GetNumberOfPolys()} triangles in .vtp and .ply")
print(f"1..{count}")
sys.exit(failed > 0)

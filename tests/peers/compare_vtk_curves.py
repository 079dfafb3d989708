"""Planar curves that batten writes as .vtu, .vtp and .vtk, read by VTK; as .csv, read by NumPy; as .svg, read by an XML
parser. Prints TAP.
Usage: compare_vtk_curves.py PROGRAM      (PROGRAM: write_curves)"""
import os
import subprocess
import sys
import tempfile
import xml.etree.ElementTree

try:
    import numpy as np
    import vtk
    from vtk.util.numpy_support import vtk_to_numpy
except ImportError as missing:
    print("1..0 # SKIP", missing)
    sys.exit(0)

VTK_BEZIER_CURVE = 75
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


def read_places(path):
    """For each curve [places][10]: t, point, derivatives."""
    out = []
    with open(path) as file:
        while head := file.readline().split():
            for _ in range(int(head[2])):
                file.readline()
            out.append(np.array([[float(x) for x in file.readline().split()] for _ in range(int(head[3]))]))
    return out


def worst_of_cells(grid, number, places):
    """Largest distance between the points of a curve's Bezier cells and those that batten evaluated, over the size."""
    domains = vtk_to_numpy(grid.GetCellData().GetArray("domain"))
    curves = vtk_to_numpy(grid.GetCellData().GetArray("curve"))
    worst = 0
    for t, *rest in places:
        index = int(np.nonzero((curves == number) & (domains[:, 0] <= t) & (t <= domains[:, 1]))[0][0])
        cell = grid.GetCell(index)
        lower, upper = domains[index]
        at, weights = [0.0] * 3, [0.0] * cell.GetNumberOfPoints()
        cell.EvaluateLocation(vtk.reference(0), [(t - lower) / (upper - lower), 0, 0], at, weights)
        worst = max(worst, np.abs(np.subtract(at, rest[:3])).max())
    return worst / np.abs(places[:, 1:4]).max()


def distance(polygon, points):
    """Largest distance of points from a polygon."""
    start, along = polygon[:-1], np.diff(polygon, axis=0)
    worst = 0
    for p in points:
        part = np.clip(((p - start) * along).sum(1) / (along * along).sum(1), 0, 1)
        worst = max(worst, np.linalg.norm(start + part[:, None] * along - p, axis=1).min())
    return worst


with tempfile.TemporaryDirectory() as folder:
    run = subprocess.run([sys.argv[1], folder], capture_output=True, text=True)
    check(run.returncode == 0, f"curves written {run.stderr.strip()}")
    path = os.path.join(folder, "curves")
    curves = [[int(x) for x in line.split()] for line in run.stdout.splitlines()]
    places = read_places(path + ".places")

    grid = read(vtk.vtkXMLUnstructuredGridReader(), path + ".vtu")
    numbers = vtk_to_numpy(grid.GetCellData().GetArray("curve"))
    types = {grid.GetCellType(i) for i in range(grid.GetNumberOfCells())}
    check(types == {VTK_BEZIER_CURVE}, f"curves.vtu: {grid.GetNumberOfCells()} Bezier curves")
    mesh = read(vtk.vtkXMLPolyDataReader(), path + ".vtp")
    legacy = read(vtk.vtkPolyDataReader(), path + ".vtk")
    points = vtk_to_numpy(mesh.GetPoints().GetData())
    offsets = vtk_to_numpy(mesh.GetLines().GetOffsetsArray())
    for i, (degree, closed, spans) in enumerate(curves):
        cells = np.nonzero(numbers == i)[0]
        sizes = {grid.GetCell(int(c)).GetNumberOfPoints() for c in cells}
        worst = worst_of_cells(grid, i, places[i])
        check(
            sizes == {degree + 1} and len(cells) == spans and worst <= 1e-13,
            f"curve {i}: {spans} cells of degree {degree}, {len(places[i])} places within {worst:.2g} of the size",
        )
        line = points[offsets[i] : offsets[i + 1]]
        worst = distance(line, places[i][:, 1:4])
        check(
            worst <= 1e-3 and np.array_equal(line[0], line[-1]) == bool(closed),
            f"curve {i}: a polyline of {len(line)} points within {worst:.2g}",
        )
    same = all(
        np.array_equal(vtk_to_numpy(mesh.GetPointData().GetArray(key)), vtk_to_numpy(legacy.GetPointData().GetArray(key)))
        for key in ("t", "curvature")
    )
    check(
        same
        and np.array_equal(points, vtk_to_numpy(legacy.GetPoints().GetData()))
        and np.array_equal(offsets, vtk_to_numpy(legacy.GetLines().GetOffsetsArray()))
        and np.array_equal(
            vtk_to_numpy(mesh.GetLines().GetConnectivityArray()), vtk_to_numpy(legacy.GetLines().GetConnectivityArray())
        )
        and list(vtk_to_numpy(legacy.GetCellData().GetArray("curve"))) == list(range(len(curves))),
        "curves.vtk: the same points, lines and fields as .vtp",
    )

    table = np.genfromtxt(path + ".csv", delimiter=",", names=True)
    check(
        table.dtype.names == ("curve", "t", "x", "y", "z", "curvature")
        and np.array_equal(np.stack([table[x] for x in "xyz"], 1), points)
        and np.array_equal(np.bincount(table["curve"].astype(int)), np.diff(offsets)),
        "curves.csv: the same points",
    )

    root = xml.etree.ElementTree.parse(path + ".svg").getroot()
    name = "{http://www.w3.org/2000/svg}"
    paths = root.findall(f"{name}g/{name}path")
    check(
        root.tag == name + "svg" and [p.get("id") for p in paths] == [f"curve-{i}" for i in range(len(curves))],
        f"curves.svg: {len(paths)} paths",
    )
print(f"1..{count}")
sys.exit(failed > 0)

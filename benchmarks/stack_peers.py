"""Solids of parallel sections by batten and by what is used elsewhere, from the same contours in the same run.

The others: the clinical standard, exact signed distances to the polygons of each slice on a grid, blended linearly between
slices (NumPy, marching cubes by VTK), and VTK's own vtkVoxelContoursToSurfaceFilter. Looked at are a torus cut at 45
degrees (truth is known), a branching solid, and a clinical heart where the data are there: every second of its
drawn slices is held out, and the distance of its points to the surface measured. Times on one thread."""
import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
import time

for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ[variable] = "1"

try:
    import numpy as np
    import vtk
    from vtk.util import numpy_support
except ImportError as missing:
    print(f"the benchmark of stacks beside peers needs NumPy and VTK ({missing}); nothing was run")
    sys.exit(0)

GRID = 160  # cells of the grid along the longest side


class Scene:
    """Slices: heights, and of each its contours [n][2]."""

    def __init__(self, name, heights, slices, truth=None, held=None):
        self.name, self.heights, self.slices, self.truth, self.held = name, heights, slices, truth, held

    def gap(self):
        return float(np.median(np.diff(self.heights)))

    def sum_of_slices(self):
        return sum(self.gap() * abs(sum(area(c) * turn(c, cs) for c in cs)) for cs in self.slices)


def area(c):
    x, y = c[:, 0], c[:, 1]
    return abs(np.dot(x, np.roll(y, -1)) - np.dot(np.roll(x, -1), y)) / 2


def inside(c, p):
    """Even-odd, p [n][2]."""
    a, b = c, np.roll(c, -1, axis=0)
    odd = np.zeros(len(p), bool)
    for (x0, y0), (x1, y1) in zip(a, b):
        if y0 != y1:
            crosses = (y0 > p[:, 1]) != (y1 > p[:, 1])
            odd ^= crosses & (p[:, 0] < x0 + (p[:, 1] - y0) * (x1 - x0) / (y1 - y0))
    return odd


def turn(c, contours):
    """1 for outer contours, -1 for holes."""
    return (-1) ** sum(int(inside(o, c[:1])[0]) for o in contours if o is not c)


def distance(contours, p):
    """Exact signed distance to polygons, positive inside."""
    least, odd = np.full(len(p), np.inf), np.zeros(len(p), bool)
    for c in contours:
        odd ^= inside(c, p)
        for a, b in zip(c, np.roll(c, -1, axis=0)):
            e = b - a
            w = p - a
            t = np.clip(w @ e / max(e @ e, 1e-300), 0, 1)
            least = np.minimum(least, np.einsum("ij,ij->i", w - t[:, None] * e, w - t[:, None] * e))
    return np.where(odd, 1, -1) * np.sqrt(least)


# ---- the ways: each returns a vtkPolyData and seconds -----------------------------------------------

def distance_fields(scene, folder):
    start = time.perf_counter()
    points = np.concatenate([c for cs in scene.slices for c in cs])
    lower, upper = points.min(axis=0), points.max(axis=0)
    gap = scene.gap()
    ends = [scene.heights[0] - gap / 2, scene.heights[-1] + gap / 2]
    cell = max(*(upper - lower), ends[1] - ends[0]) / GRID
    lower, upper = lower - 3 * cell, upper + 3 * cell
    x = np.arange(lower[0], upper[0], cell)
    y = np.arange(lower[1], upper[1], cell)
    z = np.arange(ends[0] - 2 * cell, ends[1] + 2 * cell, cell)
    grid = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    fields = [distance(cs, grid) for cs in scene.slices]
    volume = np.empty((len(z), len(grid)), np.float32)
    for k, height in enumerate(z):
        at = np.clip(np.interp(height, scene.heights, np.arange(len(fields))), 0, len(fields) - 1)
        i = min(int(at), len(fields) - 2)
        f = (1 - (at - i)) * fields[i] + (at - i) * fields[i + 1]
        volume[k] = np.minimum(f, min(height - ends[0], ends[1] - height))
    image = vtk.vtkImageData()
    image.SetDimensions(len(x), len(y), len(z))
    image.SetSpacing(cell, cell, cell)
    image.SetOrigin(x[0], y[0], z[0])
    values = volume.reshape(len(z), len(x), len(y)).transpose(0, 2, 1).ravel()
    image.GetPointData().SetScalars(numpy_support.numpy_to_vtk(values, deep=True))
    cubes = vtk.vtkMarchingCubes()
    cubes.SetInputData(image)
    cubes.SetValue(0, 0)
    cubes.Update()
    return cubes.GetOutput(), time.perf_counter() - start


def voxel_contours(scene, folder):
    """VTK's filter takes contours in units of voxels, one slice a unit."""
    start = time.perf_counter()
    all_points = np.concatenate([c for cs in scene.slices for c in cs])
    lower = all_points.min(axis=0)
    cell = np.ptp(all_points, axis=0).max() / GRID
    data, points, cells = vtk.vtkPolyData(), vtk.vtkPoints(), vtk.vtkCellArray()
    for k, contours in enumerate(scene.slices):
        for c in contours:
            ccw = np.dot(c[:, 0], np.roll(c[:, 1], -1)) - np.dot(np.roll(c[:, 0], -1), c[:, 1]) > 0
            loop = c if ccw == (turn(c, contours) > 0) else c[::-1]
            cells.InsertNextCell(len(loop))
            for x, y in (loop - lower) / cell:
                cells.InsertCellPoint(points.InsertNextPoint(x, y, k))
    data.SetPoints(points)
    data.SetPolys(cells)
    surface = vtk.vtkVoxelContoursToSurfaceFilter()
    surface.SetInputData(data)
    surface.SetMemoryLimitInBytes(500000000)
    surface.SetSpacing(cell, cell, scene.gap())
    move, place, triangles = vtk.vtkTransform(), vtk.vtkTransformPolyDataFilter(), vtk.vtkTriangleFilter()
    surface.Update()
    box = surface.GetOutput().GetBounds()  # it begins somewhere: its lower corner is put upon that of the contours
    move.Translate(lower[0] - box[0], lower[1] - box[2], scene.heights[0] - box[4])
    place.SetTransform(move)
    place.SetInputConnection(surface.GetOutputPort())
    triangles.SetInputConnection(place.GetOutputPort())
    triangles.Update()
    return triangles.GetOutput(), time.perf_counter() - start


def program(batten, *options):
    def way(scene, folder):
        contours, mesh = os.path.join(folder, "contours.txt"), os.path.join(folder, "mesh.ply")
        with open(contours, "w") as file:
            for height, cs in zip(scene.heights, scene.slices):
                for c in cs:
                    file.write("".join(f"{x!r} {y!r} {height!r}\n" for x, y in c.tolist()) + "\n")
        report = os.path.join(folder, "report.json")
        run = subprocess.run([batten, "stack", contours, "-o", mesh, "--threads", "1", "--report", report, "--quiet", *options],
                             capture_output=True, text=True)
        if run.returncode:
            raise RuntimeError(run.stderr.strip())
        reader = vtk.vtkPLYReader()
        reader.SetFileName(mesh)
        reader.Update()
        figures = json.load(open(report))
        return reader.GetOutput(), figures["time_build_s"] + figures["time_surface_s"]
    return way


# ---- what came out ------------------------------------------------------------------------------------

def measure(scene, mesh):
    clean = vtk.vtkCleanPolyData()
    clean.SetInputData(mesh)
    clean.Update()
    mesh = clean.GetOutput()
    mass, edges, parts = vtk.vtkMassProperties(), vtk.vtkFeatureEdges(), vtk.vtkConnectivityFilter()
    mass.SetInputData(mesh)
    mass.Update()
    edges.SetInputData(mesh)
    edges.FeatureEdgesOff()
    edges.ManifoldEdgesOff()
    edges.NonManifoldEdgesOn()
    edges.BoundaryEdgesOn()
    edges.Update()
    parts.SetInputData(mesh)
    parts.SetExtractionModeToAllRegions()
    parts.Update()
    out = [f"{mass.GetVolume() / scene.sum_of_slices() - 1:+.3%}", str(parts.GetNumberOfExtractedRegions()),
           str(edges.GetOutput().GetNumberOfCells())]
    if scene.truth:
        p = numpy_support.vtk_to_numpy(mesh.GetPoints().GetData()).astype(float)
        d = np.abs(scene.truth(p[(p[:, 2] > scene.heights[0]) & (p[:, 2] < scene.heights[-1])]))  # between the ends
        out.append(f"{d.mean():.4f} / {d.max():.3f}")
    elif scene.held is not None:
        locator = vtk.vtkCellLocator()
        locator.SetDataSet(mesh)
        locator.BuildLocator()
        at, cell, sub, square = [0.0] * 3, vtk.reference(0), vtk.reference(0), vtk.reference(0.0)
        d = []
        for p in scene.held:
            locator.FindClosestPoint(p, at, cell, sub, square)
            d.append(math.sqrt(square.get()))
        out.append(f"{np.mean(d):.3f} / {np.quantile(d, 0.95):.2f}")
    else:
        out.append("-")
    return out


def read_document(path):
    sections = json.load(open(path))["sections"]
    origins = np.array([s["origin"] for s in sections])
    return origins[:, 2], [[np.array(c) + o[:2] for c in s["contours"]] for s, o in zip(sections, origins)]


def torus(p):
    s = math.sqrt(0.5)
    x, y, z = s * (p[:, 0] + p[:, 2]), p[:, 1], s * (p[:, 2] - p[:, 0])
    return 0.3 - np.hypot(np.hypot(x, y) - 0.7, z)


def read_heart(path):
    """Slices 0, 2, 4, ... were drawn; 0, 4, 8, ... are kept, the others of them held out."""
    slices = {}
    for line in open(path):
        words = line.split()
        if len(words) == 3:
            x, y, z = map(float, words)
            slices.setdefault(z, []).append((x, y))
    drawn = sorted(slices)[::2]
    held = np.array([(x, y, z) for z in drawn[1::2] for x, y in slices[z]])
    return Scene("heart, drawn slices held out", np.array(drawn[::2]), [[np.array(slices[z])] for z in drawn[::2]], held=held)


def main():
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--batten", required=True)
    options.add_argument("--scenes", required=True, help="scene-sections")
    o = options.parse_args()
    ways = [("batten", program(o.batten)),
            ("batten, for smooth bodies", program(o.batten, "--between", "not-a-knot", "--saturation", "none")),
            ("batten, linear", program(o.batten, "--between", "linear")),
            ("distance fields, linear", distance_fields),
            ("vtkVoxelContoursToSurfaceFilter", voxel_contours)]
    print(f"# Stacks: peers\n\nVTK {vtk.vtkVersion().GetVTKVersion()}, NumPy {np.__version__}; one thread\n")
    print("| scene | way | volume against sum of slices | pieces | open or bad edges | distance: mean / largest (heart: "
          "95 %) | time, s |\n|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        scenes = []
        for name in ("torus", "branches", "tube"):
            path = os.path.join(folder, name + ".json")
            subprocess.run([o.scenes, name, path], check=True)
            scenes.append(Scene(name, *read_document(path), truth=torus if name == "torus" else None))
        heart = os.path.join(os.environ.get("BATTEN_SHARED", ""), "data/contours/rt_Heart.txt")
        if os.path.exists(heart):
            scenes.append(read_heart(heart))
        for scene in scenes:
            for name, way in ways:
                try:
                    mesh, seconds = way(scene, folder)
                    row = [*measure(scene, mesh), f"{seconds:.2f}"]
                except (RuntimeError, ValueError) as failure:
                    row = [str(failure)[:100], "", "", "", ""]
                print(f"| {scene.name} | {name} | " + " | ".join(row) + " |", flush=True)


main()

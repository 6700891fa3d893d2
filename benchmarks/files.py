"""From file to file without the smoothing between: seconds, MB/s, ns per node and peak memory for each format.

    python benchmarks/files.py [--nodes 1e6] [--formats su2 msh22 …] [--repeats 3] [--folder FOLDER] [--json FILE]

The mesh is a random square, written once in each format (by gmsnet, meshio and VTK, whichever has it) into the folder
and kept there. Each format is measured in a process of its own, which first does all of it with a small mesh: reading,
writing the file with all coordinates moved in the places of the old ones (what ``gmsnet smooth in out`` does around the
smoothing), and converting, which is writing the mesh as if it came from elsewhere. The least of the repeats is shown;
CPU is the time of the processor, which on a busy machine says more.

disk: what it takes to write as many bytes with nothing else done, and to wait for the disk, as gmsnet does before it
replaces a file; it is noisy, and part of the seconds of ``write``. first: all of it with the small mesh, compiling
included where kernels are not cached yet. mesh: the arrays of the mesh. peak: the most memory that reading and writing
take beyond what the process had before: the mesh, the bytes of the file and all that was made on the way.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from machine import describe

FORMATS = {  # name: (suffix, who writes the file)
    "su2": (".su2", "gmsnet"),
    "msh22": (".msh", "meshio gmsh22 text"),
    "msh41": (".msh", "gmsnet"),
    "msh22-binary": (".msh", "meshio gmsh22 binary"),
    "msh41-binary": (".msh", "meshio gmsh binary"),
    "medit": (".mesh", "gmsnet"),
    "vtk": (".vtk", "gmsnet"),
    "vtk-binary": (".vtk", "vtk binary"),
    "vtu": (".vtu", "gmsnet"),
    "vtu-base64": (".vtu", "vtk base64"),
    "vtu-raw": (".vtu", "vtk raw"),
    "vtu-zlib": (".vtu", "vtk zlib"),
    "obj": (".obj", "gmsnet"),
    "off": (".off", "gmsnet"),
    "ply": (".ply", "gmsnet"),
    "ply-binary": (".ply", "meshio ply binary"),
    "stl": (".stl", "gmsnet"),
    "stl-binary": (".stl", "meshio stl binary"),
    "triangle": (".node", "gmsnet"),
}
SMALL = 3000  # nodes of the mesh with which kernels are compiled before anything is timed


def square(nodes):
    import gmsnet

    return gmsnet.random_mesh(nodes, seed=0)


def make(mesh, path, writer):
    """The mesh as a file, by another library where gmsnet does not write the variant."""
    import gmsnet

    points = np.pad(mesh.points, ((0, 0), (0, 3 - mesh.points.shape[1])))
    triangles = np.concatenate([block.nodes for block in mesh.cells if block.kind == "triangle"])
    library, *options = writer.split()
    if library == "gmsnet":
        gmsnet.write(mesh, path)
    elif library == "meshio":
        by_meshio(points, triangles, path, *options)
    else:
        by_vtk(points, triangles, path, *options)


def by_meshio(points, triangles, path, kind, mode):
    import meshio

    entities = np.column_stack([np.full(len(points), 2), np.ones(len(points), dtype=np.int64)])
    tags = [np.ones(len(triangles), dtype=np.int32)]
    gmsh = {"point_data": {"gmsh:dim_tags": entities}, "cell_data": {"gmsh:physical": tags, "gmsh:geometrical": tags}}
    mesh = meshio.Mesh(points, [("triangle", triangles)], **(gmsh if kind.startswith("gmsh") else {}))
    meshio.write(path, mesh, file_format=kind, binary=mode == "binary")


def by_vtk(points, triangles, path, mode):
    import pyvista
    import vtk

    cells = np.column_stack([np.full(len(triangles), 3), triangles]).ravel()
    grid = pyvista.UnstructuredGrid(cells, np.full(len(triangles), 5, dtype=np.uint8), points)
    writer = vtk.vtkUnstructuredGridWriter() if mode == "binary" else vtk.vtkXMLUnstructuredGridWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(grid)
    if mode == "binary":
        writer.SetFileTypeToBinary()
    elif mode == "raw":
        writer.SetDataModeToAppended()
        writer.EncodeAppendedDataOff()
        writer.SetCompressorTypeToNone()
    else:
        writer.SetDataModeToBinary()
        if mode == "zlib":
            writer.SetCompressorTypeToZLib()
        else:
            writer.SetCompressorTypeToNone()
    if not writer.Write():
        raise OSError(f"{path}: VTK cannot write it")


def timed(work):
    """Seconds, those of the processor, and the result."""
    began, used = time.perf_counter(), time.process_time()
    result = work()
    return time.perf_counter() - began, time.process_time() - used, result


def memory(key):
    """Bytes of memory that this process has (VmRSS), or had at most since it began or since ``forget_peak`` (VmHWM)."""
    status = Path("/proc/self/status")
    if status.exists():
        return 1024 * int(status.read_text().split(f"{key}:")[1].split()[0])
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


def forget_peak():
    """From now on the peak is a new one, where the system can do that (Linux)."""
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")


def moved(mesh):
    """All coordinates a little elsewhere, with as many digits as results have."""
    points = mesh.points.copy()
    plane = list(mesh.plane)
    points[:, plane] += 1e-4 * np.random.default_rng(1).random((len(points), 2)) * np.ptp(points[:, plane], axis=0)
    return mesh.with_points(points.astype(np.float32) if mesh.single else points)


def measure(path, folder, repeats, convert):
    """Seconds and bytes of one format, in this process."""
    from gmsnet import io

    out = Path(folder) / f"out{path.suffix}"
    times = {"read": [], "write": [], "convert": []}
    peaks = []
    for _ in range(repeats):
        mesh = changed = None
        forget_peak()
        base = memory("VmRSS")
        *taken, mesh = timed(lambda: io.read(path))
        times["read"].append(taken)
        changed = moved(mesh)
        *taken, lost = timed(lambda changed=changed: io.write(changed, out))
        times["write"].append(taken)
        peaks.append(memory("VmHWM") - base)
        assert not lost, lost
    again = io.read(out)
    assert (again.points == changed.points).all()
    assert len(again.cells) == len(mesh.cells)
    rows = {"nodes": len(mesh.points), "file bytes": size_of(path), "peak bytes": min(peaks)}
    rows["mesh bytes"] = mesh.points.nbytes + sum(block.nodes.nbytes + block.regions.nbytes for block in mesh.cells)
    if convert:
        elsewhere = replace(changed, source=None)
        times["convert"] = [timed(lambda: io.write(elsewhere, out))[:2] for _ in range(repeats)]
        rows["converted bytes"] = size_of(out)
    for key, values in times.items():
        if values:
            rows[f"{key} s"], rows[f"{key} CPU s"] = (min(column) for column in zip(*values, strict=True))
    return rows


def size_of(path):
    """Bytes of a mesh file, and of the one beside it where there are two."""
    return sum(part.stat().st_size for part in {path, path.with_suffix(".ele") if path.suffix == ".node" else path})


def disk_seconds(folder, size, repeats):
    """Writing so many bytes and waiting until they are on the disk."""
    block = np.random.default_rng(0).bytes(size)

    def write():
        with open(Path(folder) / "block", "wb") as stream:
            stream.write(block)
            stream.flush()
            os.fsync(stream.fileno())

    return min(timed(write)[0] for _ in range(repeats))


def child(options):
    """One format, asked for by the parent: the results as JSON on the standard output."""
    with tempfile.TemporaryDirectory(dir=options.folder) as folder:
        small = path_of(options.folder, options.child, SMALL)
        began = time.perf_counter()
        measure(small, folder, 1, True)
        first = time.perf_counter() - began
        path = path_of(options.folder, options.child, options.nodes)
        found = measure(path, folder, options.repeats, FORMATS[options.child][1] == "gmsnet" and not options.no_convert)
        found["first s"] = first
        print(json.dumps(found))


def path_of(folder, name, nodes):
    suffix, _ = FORMATS[name]
    return Path(folder) / f"{name}-{nodes}{suffix}"


def make_all(options):
    for nodes in (SMALL, options.nodes):
        wanted = {name: path_of(options.folder, name, nodes) for name in options.formats}
        if missing := [name for name, path in wanted.items() if not path.exists()]:
            mesh = square(nodes)
            for name in missing:
                print(f"making {wanted[name]}", file=sys.stderr)
                make(mesh, wanted[name], FORMATS[name][1])


def show(rows):
    head = ["format", "MB"]
    for key in ("read", "write"):
        head += [f"{key} s", "CPU s", "MB/s", "ns/node"]
    head += ["disk s", "convert s", "CPU s", "MB/s", "first s", "mesh MB", "peak MB", "in files"]
    print("".join(f"{word:>{13 if not k else 10}}" for k, word in enumerate(head)))
    for name, row in rows.items():
        size, nodes = row["file bytes"], row["nodes"]
        cells = [name, f"{size / 1e6:.1f}"]
        for key in ("read", "write"):
            taken = row[f"{key} s"]
            cells += [f"{taken:.3f}", f"{row[f'{key} CPU s']:.3f}", f"{size / taken / 1e6:.0f}"]
            cells.append(f"{taken / nodes * 1e9:.0f}")
        cells.append(f"{row['disk s']:.3f}")
        if "convert s" in row:
            taken = row["convert s"]
            cells += [f"{taken:.3f}", f"{row['convert CPU s']:.3f}", f"{row['converted bytes'] / taken / 1e6:.0f}"]
        else:
            cells += [""] * 3
        cells += [f"{row['first s']:.2f}", f"{row['mesh bytes'] / 1e6:.0f}", f"{row['peak bytes'] / 1e6:.0f}"]
        cells.append(f"{row['peak bytes'] / size:.1f}")
        print("".join(f"{word:>{13 if not k else 10}}" for k, word in enumerate(cells)))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--nodes", type=lambda text: int(float(text)), default=1_000_000)
    parser.add_argument("--formats", nargs="+", choices=FORMATS, default=list(FORMATS))
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--no-convert", action="store_true")
    parser.add_argument("--folder", default=str(Path(tempfile.gettempdir()) / "gmsnet-files"))
    parser.add_argument("--json")
    parser.add_argument("--child", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.child:
        child(options)
        return
    Path(options.folder).mkdir(parents=True, exist_ok=True)
    make_all(options)
    print(describe())
    rows = {}
    for name in options.formats:
        command = [sys.executable, __file__, *sys.argv[1:], "--folder", options.folder, "--child", name]
        answer = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
        rows[name] = json.loads(answer.stdout)
        with tempfile.TemporaryDirectory(dir=options.folder) as folder:
            rows[name]["disk s"] = disk_seconds(folder, rows[name]["file bytes"], options.repeats)
    show(rows)
    if options.json:
        Path(options.json).write_text(json.dumps({"machine": describe(), "formats": rows}, indent=1))


if __name__ == "__main__":
    main()

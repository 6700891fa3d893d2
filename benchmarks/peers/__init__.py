"""What the comparison with other tools measures, and how.

*Meshes* of the unit square, as arrays of points and counter-clockwise triangles. ``random``: a Delaunay triangulation
of uniform points, nodes in random order. ``jittered``: a mesh as meshing software leaves it, its inner nodes thrown out
of place, in rows (meshes.py).

*Tools.* A row of the table in table.py names a class of one module here. Making it from the arrays is its set-up: all
that the tool needs to be told, which are the boundary nodes included. ``smooth(effort)`` is its smoothing, with so many
sweeps, iterations or passes. ``points()`` brings the coordinates back. All three are timed apart, each time from a new
start, after the tool has been imported and has done a small mesh.

*Effort and final state.* Each tool runs with several efforts. The largest is one beyond which it hardly becomes better:
what that gives is its final state. The least effort that brings a figure is what the tool needs for it; so it is for
gmsnet, whose effort is ``max_sweeps`` and whose time is that of the whole call, from arrays to arrays, both reports
included.

*Time* is that of the processor (user and system, of all threads of the process): on a machine that does nothing else
that is what a clock shows, for a process with one thread, and what other programs do falls on nobody. A tool in a
program of its own tells its own, without the files between. Medians of several runs. Between the runs of each process
stand runs of L, one product of SciPy's sparse averaging matrix with the coordinates, and tools are compared in
multiples of the L of their own process: a machine that is slower for a while is slower for both.

*Memory* is the peak of the process in one run beyond what it held before, with the arrays of the mesh and the imports.

*Figures* are gmsnet's, of the same triangles for all. What a tool must not do is looked at, too: whether the triangles
are the same afterwards, whether boundary nodes moved, which share of the others did.
"""

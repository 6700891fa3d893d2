"""
A batch
=======

Several files, each written by its name into a folder. A line tells of each; one that fails does not stop the others.
"""

import subprocess
from pathlib import Path

import gmsnet

cases = Path("cases")
cases.mkdir(exist_ok=True)
for k, suffix in enumerate([".su2", ".msh", ".vtu"]):
    gmsnet.write(gmsnet.random_mesh(300, seed=k), cases / f"mesh-{k}{suffix}")
(cases / "broken.su2").write_text("NDIME= 2\n")

done = subprocess.run(["gmsnet", "smooth", "cases", "--out-dir", "fixed"], capture_output=True, text=True)
print(done.stdout, done.stderr, f"exit code {done.returncode}", sep="\n")
assert done.returncode == 2  # of the worst
assert len(list(Path("fixed").iterdir())) == 3

"""Full disks, folders and files that may only be read, and files of other users."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from support.folder import SMOOTH, names

import gmsnet
from gmsnet.errors import InputError
from gmsnet.io import write
from gmsnet.mesh.mesh import Mesh

IS_ROOT = os.geteuid() == 0


@pytest.fixture(scope="module")
def mesh() -> Mesh:
    return gmsnet.random_mesh(300, seed=0)


def few_bytes() -> None:
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)  # Python does so too; a shell need not
    resource.setrlimit(resource.RLIMIT_FSIZE, (5000, 5000))


@pytest.mark.parametrize("target", ["{dir}/mesh.su2", "{dir}/new.su2", "{dir}/new.vtu"])
def test_a_file_that_gets_too_large_for_the_disk(target: str, mesh: Mesh, tmp_path: Path) -> None:
    """RLIMIT_FSIZE stops a write in the middle, as a full disk does."""
    source = tmp_path / "mesh.su2"
    write(mesh, source)
    before = source.read_bytes()
    assert len(before) > 5000
    output = target.replace("{dir}", str(tmp_path))
    # A cache of kernels that is there is only read; none can be written.
    command = [*SMOOTH, source, *(["--in-place"] if output == str(source) else [output])]
    done = subprocess.run(command, capture_output=True, text=True, preexec_fn=few_bytes, check=False)
    assert done.returncode == 2
    assert done.stderr == f"gmsnet: error: {output}: cannot be written: file too large\n"
    assert names(tmp_path) == ["mesh.su2"]
    assert source.read_bytes() == before


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="this system has no /dev/full")
def test_a_device_that_is_full(mesh: Mesh, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="/dev/full: cannot be written: no space left on device"):
        write(mesh, "/dev/full", format="su2")
    source = tmp_path / "mesh.su2"
    write(mesh, source)
    with open("/dev/full", "wb") as full:
        done = subprocess.run([*SMOOTH, source, "-"], stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 2
    assert "standard output: cannot be written: no space left on device" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_small_file_system_that_is_full(mesh: Mesh, tmp_path: Path) -> None:
    """Where one may be mounted (as the superuser, most often)."""
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", tmp_path], capture_output=True, check=False
    )
    if mounted.returncode:
        pytest.skip("no file system can be mounted here")
    try:
        small = gmsnet.random_mesh(30, seed=0)
        write(small, tmp_path / "out.su2")
        before = (tmp_path / "out.su2").read_bytes()
        with pytest.raises(InputError, match=r"out\.su2: cannot be written: no space left on device"):
            write(gmsnet.random_mesh(2000, seed=0), tmp_path / "out.su2")
        assert (tmp_path / "out.su2").read_bytes() == before
        assert names(tmp_path) == ["out.su2"]
        # What a killed process left fills the disk: it is removed before anything is written.
        (tmp_path / ".gmsnet-0123456789ab.tmp").write_bytes(bytes((1 << 16) - 2 * len(before) - 8192))
        write(small.with_points(2.0 * small.points), tmp_path / "out.su2")
        assert names(tmp_path) == ["out.su2"]
    finally:
        subprocess.run(["umount", tmp_path], check=True)


AS_NOBODY = """
import os, sys, tempfile
import gmsnet
from gmsnet.cli import main
with tempfile.TemporaryDirectory() as folder:  # what is needed is loaded while it may be read
    path = folder + "/mesh.su2"
    gmsnet.write(gmsnet.random_mesh(300, seed=1), path)
    assert main(["smooth", path, folder + "/out.su2"]) == 0
sys.stdout = open(os.devnull, "w")
if os.geteuid() == 0:
    os.setgroups([])
    os.setgid(65534)
    os.setuid(65534)
sys.exit(main(["smooth", *sys.argv[1:]]))
"""


def as_nobody(*arguments: object) -> subprocess.CompletedProcess[str]:
    """Runs ``gmsnet smooth`` without the superuser's rights, which no permission stops."""
    return subprocess.run(
        [sys.executable, "-c", AS_NOBODY, *map(str, arguments)], capture_output=True, text=True, check=False
    )


@pytest.fixture
def open_folder():
    """A folder that others can reach."""
    with tempfile.TemporaryDirectory(prefix="gmsnet-test-") as folder:
        os.chmod(folder, 0o755)
        yield Path(folder)


def test_a_folder_that_may_only_be_read(mesh: Mesh, open_folder: Path) -> None:
    source = open_folder / "mesh.su2"
    write(mesh, source)
    before = source.read_bytes()
    source.chmod(0o666)
    open_folder.chmod(0o555)
    try:
        for target in (["--in-place"], [str(open_folder / "new.su2")]):
            done = as_nobody(source, *target)
            assert done.returncode == 2
            assert f"the folder {open_folder} is write-protected" in done.stderr
            assert done.stderr.count("\n") == 1
    finally:
        open_folder.chmod(0o755)
    assert source.read_bytes() == before
    assert names(open_folder) == ["mesh.su2"]


def test_a_file_that_may_only_be_read(mesh: Mesh, open_folder: Path) -> None:
    open_folder.chmod(0o777)
    source = open_folder / "mesh.su2"
    write(mesh, source)
    before = source.read_bytes()
    source.chmod(0o444)
    done = as_nobody(source, "--in-place")
    assert done.returncode == 2
    assert f"{source}: the file is write-protected; name another output" in done.stderr
    assert source.read_bytes() == before
    secret = open_folder / "secret.su2"
    write(mesh, secret)
    secret.chmod(0o000)
    done = as_nobody(secret, open_folder / "out.su2")
    assert done.returncode == 2
    assert f"{secret}: cannot be read: permission denied" in done.stderr


def test_another_users_leftover_does_no_harm(mesh: Mesh, open_folder: Path) -> None:
    if not IS_ROOT:
        pytest.skip("only the superuser can be two users")
    open_folder.chmod(0o1777)
    (open_folder / ".gmsnet-0123456789ab.tmp").write_text("root's")
    (open_folder / ".gmsnet-0123456789ab.tmp").chmod(0o600)
    source = open_folder / "mesh.su2"
    write(mesh, source)
    (open_folder / ".gmsnet-0123456789ab.tmp").write_text("root's")
    source.chmod(0o644)
    done = as_nobody(source, open_folder / "out.su2", "--quiet")
    assert (done.returncode, done.stderr) == (0, "")
    assert names(open_folder) == [".gmsnet-0123456789ab.tmp", "mesh.su2", "out.su2"]

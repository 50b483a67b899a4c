"""What no one should import is refused in one line, in bounded time and memory: in a process of its
own, whose peak is measured."""

import json
import struct
import subprocess
import sys
import zipfile

import numpy as np
import pytest

from tests.support.paths import ROOT
from tests.support.world.meshes import CATALOGUE, TRIANGLES, library, mesh, y_up
from world.meshes import sweethome

#: Reads every file of a folder as the importer does, and says what came of it and what it took.
WORK = """
import json, resource, sys, time
from dataclasses import replace
from pathlib import Path
from world.errors import InhabitError
from world.meshes import importing
from world.meshes.build import ImportOptions

def peak():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024

import trimesh, vhacdx, scipy.spatial
start, found = peak(), {}
for path in sorted(Path(sys.argv[1]).iterdir()):
    before = time.process_time()
    try:
        jobs = importing.jobs([path], ImportOptions())
        said = [job.refused for job in jobs if job.refused]
        for job in jobs:
            if not job.refused:
                importing.make(replace(job, options=replace(job.options, category="chair")), "")
    except InhabitError as error:
        said = [str(error)]
    found[path.name] = (said, time.process_time() - before, peak() - start)
print(json.dumps(found))
"""
SAID = {
    "scan.obj": "2000000 triangles; decimate it to at most 500000",
    "scan.stl": "2000000 triangles",
    "copies.gltf": "4000000 triangles",
    "bomb.sh3f": "more than 67 MB unpacked",
    "many-bombs.sh3f": "MB unpacked; at most 20000 of 1074 MB",
    "room.stl": "a scene of 50 objects; export one piece a file",
    "centimetres.stl": "give --unit cm",
    "huge.stl": "is no furniture; give",
    "outside.sh3f": "a path outside the library",
    "outside.gltf": "names a file outside its folder",
    "empty.obj": "no triangles in it",
    "nothing.stl": "an empty file",
    "not-a-number.obj": "coordinates that are no numbers",
}


def stl(corners: np.ndarray) -> bytes:
    content = mesh(corners).export(file_type="stl")
    assert isinstance(content, bytes)
    return content


@pytest.fixture(scope="module")
def refusals(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[list[str], float, int]]:
    """By file: what was said, processor time (s), and how far the peak of memory has risen."""
    folder = tmp_path_factory.mktemp("meshes")
    count = 2_000_000
    (folder / "scan.obj").write_bytes(b"v 0 0 0\nv 1 0 0\nv 0 1 0" + b"\nf 1 2 3" * count)
    (folder / "scan.stl").write_bytes(bytes(80) + struct.pack("<I", count) + bytes(50 * count))
    copies = {
        "asset": {"version": "2.0"},
        "accessors": [{"count": 3000, "componentType": 5125, "type": "SCALAR"}],
        "meshes": [{"primitives": [{"indices": 0, "attributes": {"POSITION": 0}}]}],
        "nodes": [{"mesh": 0}] * 4000,
    }
    (folder / "copies.gltf").write_text(json.dumps(copies))
    zeros = bytes(sweethome.MAX_ENTRY_BYTES + 1)
    (folder / "bomb.sh3f").write_bytes(library({"models/chair.obj": zeros}, CATALOGUE))
    with zipfile.ZipFile(folder / "many-bombs.sh3f", "w", zipfile.ZIP_DEFLATED) as archive:
        for index in range(17):
            archive.writestr(f"{index}.obj", zeros, compresslevel=1)
    spots = [np.array([1.2 * (i % 10), 1.2 * (i // 10), 0.0]) for i in range(50)]
    (folder / "room.stl").write_bytes(stl(np.concatenate([TRIANGLES + spot for spot in spots])))
    (folder / "centimetres.stl").write_bytes(stl(100 * TRIANGLES))
    tall = 80.0 / float(TRIANGLES[..., 2].max())
    (folder / "huge.stl").write_bytes(stl(tall * TRIANGLES))
    evil = {"../../evil.obj": y_up(TRIANGLES).tobytes()}
    (folder / "outside.sh3f").write_bytes(library(evil, CATALOGUE))
    outside = {"asset": {"version": "2.0"}, "buffers": [{"uri": "/etc/hostname"}], "meshes": []}
    (folder / "outside.gltf").write_text(json.dumps(outside))
    (folder / "empty.obj").write_text("o nothing\nv 0 0 0\nv 1 0 0\nv 0 1 0\n")
    (folder / "nothing.stl").write_bytes(b"")
    (folder / "not-a-number.obj").write_text("v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    done = subprocess.run(
        [sys.executable, "-c", WORK, str(folder)],
        capture_output=True, text=True, check=True, cwd=ROOT,
    )  # fmt: skip
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.parametrize("name", SAID)
def test_each_is_refused_in_one_line(name: str, refusals: dict) -> None:
    said, _, _ = refusals[name]
    assert any(SAID[name] in line for line in said), said
    assert all("\n" not in line for line in said)


def test_none_takes_long_or_much(refusals: dict) -> None:
    """The largest file has 100 MB, an entry of a library may have 64: a few times that, no more."""
    assert set(refusals) == set(SAID)
    assert max(seconds for _, seconds, _ in refusals.values()) < 20.0
    assert max(rise for _, _, rise in refusals.values()) < 500e6

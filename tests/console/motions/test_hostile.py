"""A folder with bad motions: each is refused in a line, the good one imported, memory bounded."""

import os
import pickle
import resource
import subprocess
import sys
from pathlib import Path

import numpy as np

from console.app import main
from tests.support import small_clips
from tests.support.paths import ROOT

BAD = {
    "huge.txt": b'{"Frames": [' + b"[" * 100_000,
    "broken.bvh": b"HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 99999999999 Xposition\n",
    "spin.pkl": b"",
    "numbers.pkl": pickle.dumps({"frames": np.full((9, 34), np.nan), "fps": 30}),
}


def spinning() -> bytes:
    """A pickle that keeps a processor busy for ever: the hash of tuples within tuples."""
    text = b"\x80\x02)"
    for _ in range(60):
        text += b"2\x86"  # DUP, TUPLE2
    return text[:2] + b"}" + text[2:] + b"K\x01s."


def test_one_bad_file_never_stops_a_folder(tmp_path: Path) -> None:
    folder = small_clips.write(tmp_path / "in")
    good = sorted(path.stem for path in folder.glob("*.npz"))
    for name, content in BAD.items():
        (folder / name).write_bytes(content or spinning())
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    done = subprocess.run(
        [sys.executable, "-m", "console", "motions", "import", str(folder), "--out",
         str(tmp_path / "out")],
        capture_output=True, text=True, cwd=ROOT, env=dict(os.environ, PYTHONPATH=str(ROOT)),
    )  # fmt: skip
    assert done.returncode == 1
    assert sorted(path.stem for path in (tmp_path / "out").glob("*.npz")) == good
    signs = "inhabit motions: "  # of life, where nothing else is said for 2 s
    lines = [line for line in done.stderr.splitlines() if not line.startswith(signs)]
    assert len(lines) == len(BAD), done.stderr
    for name in BAD:
        assert sum(name in line for line in lines) == 1, name
    spin = next(line for line in lines if "spin.pkl" in line)
    assert "not done after" in spin and "leave it out" in spin
    assert resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss < max(before, 2_000_000)  # kB


def test_check_reports_unreadable_files(tmp_path: Path, capsys: object) -> None:
    folder = small_clips.write(tmp_path / "in")
    (folder / "bad.pkl").write_bytes(BAD["numbers.pkl"])
    assert main(["motions", "check", str(folder), "--json"]) == 1

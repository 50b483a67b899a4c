"""Nothing that comes from outside is unpickled: no module of the package has the means to."""

import ast
import pickle
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.paths import ROOT

ROOMS = ("world", "rpc", "policy", "actors", "discriminator", "learner", "console")
#: The one reader of pickles: of numbers alone, everything else is refused.
RESTRICTED = "world/motions/formats/safe_pickle.py"
UNPICKLERS = {"pickle", "_pickle", "cPickle", "dill", "cloudpickle", "shelve", "marshal", "joblib"}


def faults(source: str, where: str) -> Iterator[str]:
    """Each way in which a module could unpickle, or run, what it reads."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names = [alias.name.partition(".")[0] for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names = [(node.module or "").partition(".")[0]]
        else:
            names = []
        for name in set(names) & UNPICKLERS:
            yield f"{where}:{node.lineno} imports {name}"
        if not isinstance(node, ast.Call):
            continue
        called = ast.unparse(node.func)
        keywords = {k.arg: ast.unparse(k.value) for k in node.keywords}
        if called == "torch.load" and keywords.get("weights_only") != "True":
            yield f"{where}:{node.lineno} torch.load without weights_only=True"
        if keywords.get("allow_pickle", "False") != "False":
            yield f"{where}:{node.lineno} allow_pickle={keywords['allow_pickle']}"
        if called in ("yaml.load", "eval", "exec", "read_pickle", "pd.read_pickle"):
            yield f"{where}:{node.lineno} {called}"


def test_no_module_unpickles() -> None:
    files = [path for room in ROOMS for path in sorted((ROOT / room).rglob("*.py"))]
    assert len(files) > 150
    found = [
        fault
        for path in files
        if (name := path.relative_to(ROOT).as_posix()) != RESTRICTED
        for fault in faults(path.read_text(), name)
    ]
    assert found == []


@pytest.mark.parametrize(
    "source",
    [
        "import pickle",
        "from cloudpickle import loads",
        "import numpy as np\nnp.load(path, allow_pickle=True)",
        "import torch\ntorch.load(path)",
        "import torch\ntorch.load(path, weights_only=False)",
        "eval(text)",
    ],
)
def test_the_search_finds_what_it_is_for(source: str) -> None:
    assert len(list(faults(source, "x.py"))) == 1


class Bomb:
    """Runs a command when it is unpickled the ordinary way."""

    def __init__(self, mark: Path) -> None:
        self.mark = mark

    def __reduce__(self) -> tuple[object, tuple[str]]:
        import os

        return os.system, (f"touch {self.mark}",)


def test_a_clip_with_a_payload_is_refused_unrun(tmp_path: Path) -> None:
    from world.errors import InhabitError
    from world.motions.formats import registry

    mark, clip = tmp_path / "ran", tmp_path / "clip.pkl"
    clip.write_bytes(pickle.dumps({"poses": Bomb(mark)}))
    with pytest.raises(InhabitError) as caught:
        registry.read(clip)
    assert not mark.exists()
    assert "\n" not in str(caught.value)

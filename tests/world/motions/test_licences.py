"""The licence and the data set of motion files, in words."""

from pathlib import Path

from tests.support import foreign_motions, small_clips
from world.motions import clip_file, load
from world.motions.formats import registry
from world.motions.licences import dataset, licence, named
from world.motions.retarget.convert import retargeted


def test_the_line_that_tells_the_licence(tmp_path: Path) -> None:
    file = tmp_path / "a.bvh"
    assert licence(file) == "not stated"
    readme = tmp_path / "README.md"
    readme.write_text("# Clips\nFrom somewhere.\n")
    assert licence(file) == "not stated"
    readme.write_text("# Clips\n- **License:** CC BY 4.0, with credit\n- Licence: other\n")
    assert licence(file) == "License: CC BY 4.0, with credit"
    readme.write_text(
        "# Takes\n\n**Source.** " + "Somebody. " * 30 + "**For non-commercial research only**: so."
    )
    assert licence(file) == "For non-commercial research only: so."
    readme.write_text("Licence: " + "x" * 500)
    assert len(licence(file)) > 200  # whole, whatever its length


def test_a_file_of_terms_beside_a_motion_comes_first(tmp_path: Path) -> None:
    (tmp_path / "README.md").write_text("Licence: MIT\n")
    (tmp_path / "walk.bvh.license").write_text("CC BY-NC 4.0\nsynthesised by policy sit\n")
    assert licence(tmp_path / "walk.bvh") == "CC BY-NC 4.0"
    assert licence(tmp_path / "run.bvh") == "Licence: MIT"


def test_a_catalogue_names_the_data_set_and_whom_to_credit(tmp_path: Path) -> None:
    (tmp_path / "INDEX.csv").write_text(
        "file,dataset,licence,creator\na.bvh,ACCAD,CC BY 3.0,Ohio State\nb.bvh,CMU,,\n"
    )
    assert licence(tmp_path / "a.bvh") == "CC BY 3.0, Ohio State"
    assert licence(tmp_path / "b.bvh") == "not stated" and dataset(tmp_path / "b.bvh") == "CMU"
    assert named("a.bvh", "ACCAD") == "a.bvh (ACCAD)" and named("a.bvh", "") == "a.bvh"


def test_clips_carry_both(tmp_path: Path) -> None:
    """An imported motion, and a raw folder of clips that state no terms of their own."""
    folder = small_clips.write(tmp_path / "raw")
    path = sorted(folder.glob("*.npz"))[0]
    clip = clip_file.read(path)
    (folder / "INDEX.csv").write_text("file,dataset,license\nmoved,Mine,CC-BY-NC-4.0\n")
    moved = foreign_motions.bvh_of(folder / "moved.bvh", clip)
    imported = retargeted(registry.read(moved))
    assert (imported.source, imported.licence) == ("moved.bvh (Mine)", "CC-BY-NC-4.0")
    clip_file.write(tmp_path / "out.npz", imported)
    again = load.read(tmp_path / "out.npz")
    assert (again.source, again.licence) == (imported.source, imported.licence)

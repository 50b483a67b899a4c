"""The terms of a folder, from its README."""

from pathlib import Path

from world.motions.licences import licence


def test_the_line_that_tells_the_licence(tmp_path: Path) -> None:
    assert licence(tmp_path) == "not stated"
    readme = tmp_path / "README.md"
    readme.write_text("# Clips\nFrom somewhere.\n")
    assert licence(tmp_path) == "not stated"
    readme.write_text("# Clips\n- **License:** CC BY 4.0, with credit\n- Licence: other\n")
    assert licence(tmp_path) == "License: CC BY 4.0, with credit"
    readme.write_text(
        "# Takes\n\n**Source.** " + "Somebody. " * 30 + "**For non-commercial research only**: so."
    )
    assert licence(tmp_path) == "For non-commercial research only: so."
    readme.write_text("Licence: " + "x" * 500)
    assert len(licence(tmp_path)) > 200  # whole, whatever its length


def test_a_file_of_terms_beside_a_motion_comes_first(tmp_path: Path) -> None:
    (tmp_path / "README.md").write_text("Licence: MIT\n")
    (tmp_path / "walk.bvh.license").write_text("CC BY-NC 4.0\nsynthesised by policy sit\n")
    assert licence(tmp_path, "walk.bvh") == "CC BY-NC 4.0"
    assert licence(tmp_path, "run.bvh") == licence(tmp_path) == "Licence: MIT"

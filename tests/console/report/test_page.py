"""The report's page: its headline and its text."""

from pathlib import Path

from console.commands import Evaluate
from console.report import page
from console.report.command import headline


def test_the_headline_is_of_the_largest_evaluation_of_this_checkpoint() -> None:
    own = {"iteration": 5, "perturbation": "none", "start_m": [1, 10], "objects": "test"}
    own["trials"] = 96
    more = own | {"trials": 4096}
    others = [own | {"trials": 9999, key: 0} for key in ("iteration", "start_m", "objects")]
    others.append(own | {"trials": 9999, "perturbation": "moved"})
    assert headline([*others, more], own) is more
    assert headline(others, own) is own


def test_text_in_the_page_is_escaped() -> None:
    table = page.table(("<b>", "n"), [("a&b", "<script>")])
    assert "<script>" not in table and "&lt;b&gt;" in table and "a&amp;b" in table
    assert Evaluate(Path("x")).quality > 0


def test_documents_contain_the_viewer_or_share_it() -> None:
    whole = page.document("a & b", ["<p>x</p>"], [{"about": "</script>"}])
    assert "class Viewer" in whole and "<style>" in whole and "<\\/script>" in whole
    linked = page.document("a & b", ["<p>x</p>"], [{"about": "</script>"}], linked=True)
    assert (
        '<script src="viewer.js">' in linked and '<link rel="stylesheet" href="page.css">' in linked
    )
    assert "class Viewer" not in linked and "<style>" not in linked
    assert "class Viewer" in page.shared("viewer.js") and "--paper" in page.shared("page.css")


def test_tables_of_words_wrap() -> None:
    assert '<table class="words">' in page.table(("", ""), [("a", "b")], words=True)
    assert "<table>" in page.table(("", ""), [("a", "b")])

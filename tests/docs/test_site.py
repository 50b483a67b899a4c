"""The site: it builds strictly without network, is generated from the code, and speaks plainly."""

import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

import pytest

from console.app import parse
from console.manual import fields
from docs.generate import commands, hook, snippets
from tests.support.paths import ROOT

DOCS = ROOT / "docs"
PAGES = {p.relative_to(DOCS).as_posix(): p.read_text() for p in sorted(DOCS.rglob("*.md"))}
PLAIN = {name: text for name, text in PAGES.items() if not name.startswith("lab-notes/")}
#: Words of earlier days; the right-hand words are in the glossary.
PRIVATE = (
    "porter", "pupil", "servoes", "looks on", "looking on", "company", "patience", "black box",
    "is told", "balks", "laden", "lesson", "sleeper", "led arms", "who is late", "ends for good",
)  # fmt: skip


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The built site; a warning of mkdocs fails it."""
    folder = tmp_path_factory.mktemp("site")
    words = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "-d", str(folder)]
    # a proxy that is not there: a build that wants the network fails
    nowhere = dict.fromkeys(("http_proxy", "https_proxy", "all_proxy"), "http://127.0.0.1:9")
    environment = {"PATH": "", "NO_MKDOCS_2_WARNING": "1", "HOME": str(folder), **nowhere}
    done = subprocess.run(words, cwd=ROOT, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


class Addresses(HTMLParser):
    """What a page loads, and the anchors that it has and links to."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.loaded: list[str] = []
        self.linked: list[str] = []
        self.anchors: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = {name: value or "" for name, value in attrs}
        if tag in ("script", "img", "iframe", "source") and "src" in found:
            self.loaded.append(found["src"])
        if tag == "link" and found.get("rel") != "canonical":
            self.loaded.append(found.get("href", ""))
        if tag == "a" and "href" in found:
            self.linked.append(found["href"])
        if "id" in found:
            self.anchors.add(found["id"])


def test_the_site_loads_nothing_from_elsewhere(site: Path) -> None:
    pages = list(site.rglob("*.html"))
    assert len(pages) > 40
    elsewhere = {
        f"{page.relative_to(site)}: {address}"
        for page in pages
        for address in Addresses(page.read_text()).loaded
        if re.match(r"(https?:)?//", address)
    }
    assert not elsewhere


def test_links_lead_somewhere(site: Path) -> None:
    pages = {page.resolve(): Addresses(page.read_text()) for page in site.rglob("*.html")}
    broken = []
    for page, addresses in pages.items():
        if page.name == "404.html":
            continue
        for address in addresses.linked + addresses.loaded:
            if re.match(r"[a-z]+:|//", address) or address in ("", "#", "."):
                continue
            path, _, anchor = address.partition("#")
            target = (page.parent / path).resolve() if path else page
            if target.is_dir():
                target /= "index.html"
            known = target in pages and (not anchor or anchor in pages[target].anchors)
            if not (known or (target not in pages and target.exists())):
                broken.append(f"{page.relative_to(site.resolve())}: {address}")
    assert not broken


def test_every_generated_page_is_in_the_site(site: Path) -> None:
    for uri in hook.pages():
        assert (site / uri).with_suffix(".html").exists(), uri


def test_pages_use_the_words_of_the_field() -> None:
    found = []
    for name, page in {**PLAIN, **hook.pages()}.items():
        text = re.sub(r"```.*?```|`[^`]*`", "", page, flags=re.DOTALL).lower()
        found += [f"{name}: {word}" for word in PRIVATE if word in " ".join(text.split())]
    assert not found


def test_files_named_in_repository_pages_exist() -> None:
    missing = []
    for page in (ROOT / "README.md", ROOT / "CONTRIBUTING.md"):
        text = page.read_text()
        linked = re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", text)
        named = re.findall(r"`((?:world|policy|console|docs|learner|rpc|deploy)/[\w/.-]+)`", text)
        missing += [n for n in (*linked, *named) if "NAME" not in n and not (ROOT / n).exists()]
    for name, text in PLAIN.items():
        named = re.findall(r"`((?:world|policy|console|docs|examples|deploy)/[\w/.-]+)`", text)
        missing += [f"{name}: {n}" for n in named if "NAME" not in n and not (ROOT / n).exists()]
    assert not missing


def test_flags_named_in_pages_exist() -> None:
    """Of every `inhabit ...` line and every flag in backticks."""
    found = [f for _, entries in commands.GROUPS for e in entries for f in fields.walk(e.flags)]
    known = {f.flag for f in found} | {"--help", "--help-all", "--debug"}
    pairs = [f.flag.rpartition(".") for f in found if f.kind == "yes or no"]
    known |= {f"{group}.no-{last}" for group, _, last in pairs if group}
    known |= {last.replace("--", "--no-") for group, _, last in pairs if not group}
    unknown = []
    for name, text in {**PLAIN, "README.md": (ROOT / "README.md").read_text()}.items():
        joined = snippets.filled(text).replace("\\\n", " ")
        lines = [line for line in joined.splitlines() if re.match(r"\s*inhabit ", line)]
        quoted = [q for q in re.findall(r"`([^`\n]+)`", joined) if re.match(r"inhabit |--", q)]
        for line in (*lines, *quoted):
            used = re.findall(r"(?<![\w-])--[a-z][\w.-]*", line.partition("#")[0])
            unknown += [f"{name}: {flag}" for flag in used if flag not in known | FOREIGN]
    assert not unknown


#: Flags of other programs that pages name in backticks.
FOREIGN = {"--block", "--dashboard-agent-listen-port", "--temp-dir", "--kills"}
#: Those of the script that packs a training for a machine without network.
FOREIGN |= set(re.findall(r'"(--[a-z-]+)"', (ROOT / "deploy/offline.py").read_text()))


@pytest.mark.parametrize("policy", ["sit", "lie"])
def test_the_command_of_a_recipe_is_the_policys_own(policy: str) -> None:
    block = snippets.command(policy)
    words = block.strip("`").removeprefix("sh").replace("\\\n", " ").split()
    command = parse(words[1:])
    asked = {f.name: f.default for f in fields.walk(type(command.experiment), command.experiment)}
    for field in snippets.changed(policy, type(command.experiment)()):
        if not field.name.startswith("world.motions"):
            assert asked[field.name] == field.default, field.name


@pytest.mark.parametrize("recipe", ["sit", "lie", "carry"])
def test_recipes_are_short(recipe: str) -> None:
    text = (DOCS / f"how-to/recipes/{recipe}.md").read_text()
    assert len(snippets.filled(text).splitlines()) <= 150


def test_the_readme_is_short() -> None:
    assert len((ROOT / "README.md").read_text().splitlines()) <= 120


def test_the_glossary_is_in_order_and_has_about_forty_terms() -> None:
    terms = re.findall(r"^## (.+)$", PAGES["glossary.md"], re.MULTILINE)
    assert 40 <= len(terms) <= 60
    assert terms == sorted(terms, key=lambda term: term.lower().replace("-", " "))

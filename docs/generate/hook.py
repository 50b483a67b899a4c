"""Hook of mkdocs: adds the generated pages to those on disk."""

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

from docs.generate import (
    api,
    commands,
    configuration,
    features,
    formats,
    metrics,
    protocol,
    results,
    snippets,
)


def pages() -> dict[str, str]:
    """Markdown of every generated page, by where it stands under docs/."""
    return {
        "reference/commands.md": commands.page(),
        "reference/configuration.md": configuration.page(),
        "reference/metrics.md": metrics.page(),
        "reference/features.md": features.page(),
        "reference/file-formats.md": formats.page(),
        "results/policies.md": results.page(),
        **{f"reference/protocol-{name}.md": protocol.page(name) for name in protocol.FILES},
        **{f"reference/api/{room}.md": api.page(room) for room in api.ROOMS},
    }


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Called by mkdocs once it has found the pages on disk."""
    for uri, text in pages().items():
        files.append(File.generated(config, uri, content=text))
    return files


def on_page_markdown(markdown: str, **_: object) -> str:
    """Called by mkdocs for each page."""
    return snippets.filled(markdown)

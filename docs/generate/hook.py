"""Hook of mkdocs: adds the generated pages to those on disk."""

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

from console.report.page import shared
from docs.generate import (
    ablations,
    api,
    commands,
    configuration,
    features,
    formats,
    gallery,
    metrics,
    peers,
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
        "gallery/index.md": gallery.page(),
        "results/policies.md": results.page(),
        "results/ablations.md": ablations.page(),
        "results/peers.md": peers.page(),
        **{f"reference/protocol-{name}.md": protocol.page(name) for name in protocol.FILES},
        **{f"reference/api/{package}.md": api.page(package) for package in api.PACKAGES},
    }


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Called by mkdocs once it has found the pages on disk."""
    for uri, text in pages().items():
        files.append(File.generated(config, uri, content=text))
    for name in gallery.SHARED:
        files.append(File.generated(config, f"gallery/{name}", content=shared(name)))
    return files


def on_page_markdown(markdown: str, **_: object) -> str:
    """Called by mkdocs for each page."""
    return snippets.filled(markdown)

"""What `make docs` adds to the pages of this folder: pages that are made of other files, equations, and a last check.

MkDocs calls the functions `on_...`, see its documentation of hooks.
"""

import re
import sys
from pathlib import Path

from latex2mathml.converter import convert
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File
from pygments.formatters import HtmlFormatter

_ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(_ROOT))
from docs.notebook import as_markdown  # noqa: E402

# pages of the site that are files elsewhere in the project
_ELSEWHERE = {
    "index.md": "README.md",
    "tables.md": "results/README.md",
    "contributing.md": "CONTRIBUTING.md",
    "changes.md": "CHANGELOG.md",
}
_PAGES = {source: page for page, source in _ELSEWHERE.items()}
_LINK = re.compile(r"(?<=\]\()([^)#\s]+)(?=[)#])")
# what a page would load from the network: scripts, styles, fonts, pictures; a link that a reader may follow is none
_LOADED = re.compile(
    r"""<(?:script|img|iframe|source)[^>]*\ssrc=["'](?:https?:)?//[^"']+|<link[^>]*href=["']https?://[^"']+"""
)
_LOADED_BY_STYLE = re.compile(r"""(?:url\(\s*["']?|@import\s+["'])(?:https?:)?//[^"')]+""")


def on_config(config):
    """Blocks of the language `math` become MathML, which browsers show by themselves."""
    fence = {"name": "math", "class": "math", "format": _equation}
    config["mdx_configs"].setdefault("pymdownx.superfences", {})["custom_fences"] = [fence]
    return config


def on_files(files, config):
    """Add the pages that are made of files elsewhere, and the style of code."""
    made = {page: _ROOT.joinpath(source).read_text(encoding="utf-8") for page, source in _ELSEWHERE.items()}
    made["configuration.md"] = _configuration()
    made["tutorial.md"] = as_markdown(_ROOT / "docs/tutorial.ipynb")
    made["site.css"] = _STYLE + HtmlFormatter(style="friendly").get_style_defs(".highlight")
    for name, text in made.items():
        files.append(File.generated(config, name, content=text))
    return files


def on_page_markdown(markdown, page, config, files):
    """Links to files of the project as links to the site's pages."""
    folder = Path(_ELSEWHERE.get(page.file.src_uri, "docs/page.md")).parent
    return _LINK.sub(lambda found: _on_site(found[1], folder), markdown)


def on_post_build(config):
    """Refuse a site that loads anything from the network."""
    site = Path(config["site_dir"])
    patterns = {".html": _LOADED, ".css": _LOADED_BY_STYLE}
    loaded = [
        f"{path.relative_to(site)}: {found[0]}"
        for path in sorted(site.rglob("*"))
        if path.suffix in patterns
        for found in patterns[path.suffix].finditer(path.read_text(encoding="utf-8"))
    ]
    if loaded:
        raise PluginError("pages load from the network: " + "; ".join(loaded))


def _on_site(target, folder):
    """A link's target as the site has it; folder: of the file that has the link, in the project."""
    if "://" in target:
        return target
    parts = []
    for part in (folder / target).as_posix().split("/"):
        parts = parts[:-1] if part == ".." else [*parts, part]
    path = "/".join(parts)
    return _PAGES.get(path, path.removeprefix("docs/"))


def _equation(source, _language, _class, _options, _markdown, **_more):
    """A block of LaTeX as MathML."""
    return f'<div class="math">{convert(source, display="block")}</div>'


def _configuration():
    """The page of the configuration: the file itself, whose comments have the units and sources."""
    return _CONFIGURATION.format(_ROOT.joinpath("config.yaml").read_text(encoding="utf-8"))


_CONFIGURATION = """# Configuration

`config.yaml` holds every setting of the studies, each with its unit in the key and its source in a comment. Your own
configuration changes single keys: `--configfile mine.yaml` of Snakemake, `--config mine.yaml` of `rrru`.
`rrru/pipeline/config.schema.yaml` says which values are allowed. A wrong key or value is refused with its place.
[own-data](own-data.md) has the keys of a campaign, [own-robot](own-robot.md) those of a robot.

```yaml
{}```
"""


_STYLE = """
.wy-nav-content { max-width: 1000px; }
.math { overflow-x: auto; margin: 0.8em 0; }
.wy-table-responsive table td, .wy-table-responsive table th { white-space: normal; }
.rst-content pre { padding: 0.6em 0.8em; overflow-x: auto; }
"""

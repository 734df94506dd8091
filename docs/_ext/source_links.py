"""Links of our Markdown pages that lead out of `docs/`: to an example's page here, or to a file at GitHub."""

import re

from sphinx.application import Sphinx

OUTSIDE = r"\]\({up}(?!README\.md\)|CHANGELOG\.md\))([^)\s#]+)\)"


def point(app: Sphinx, docname: str, source: list[str]) -> None:
    """Point a page's links to `../examples/x.py` to that example's page, and others to the repository.

    The header of the examples is the gallery. On GitHub they lead to the file itself, and a site has no such files.
    """
    depth = docname.count("/")

    def target(link: re.Match[str]) -> str:
        path = link[1]
        if path == "examples/GALLERY_HEADER.rst":
            return f"]({'../' * depth}gallery/index.rst)"
        without_page = re.search(app.config.sphinx_gallery_conf["ignore_pattern"], path)
        if path.startswith("examples/") and path.endswith(".py") and not without_page:
            return f"]({'../' * depth}gallery/{path.removeprefix('examples/').removesuffix('.py')}.rst)"
        return f"]({app.config.repository}/blob/main/{path})"

    source[0] = re.sub(OUTSIDE.format(up=r"\.\./" * (depth + 1)), target, source[0])


def setup(app: Sphinx) -> dict[str, bool]:
    """Register with Sphinx."""
    app.add_config_value("repository", "", "env", str)
    app.connect("source-read", point)
    return {"parallel_read_safe": True, "parallel_write_safe": True}

"""What is asserted of how objects show themselves."""

from __future__ import annotations

from html.parser import HTMLParser

WORST_LABEL = '<script>alert("x")</script> & $x_$ {y}'
OURS = {"table", "caption", "tr", "th", "td"}
WIDTH = 100  # characters: a line of a terminal, whatever the size of the object


class _Tags(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.tags: set[str] = set()
        self.text = ""

    def handle_starttag(self, tag: str, attrs: object) -> None:
        self.tags.add(tag)

    def handle_data(self, data: str) -> None:
        self.text += data + " "


def line_of(shown: object) -> str:
    """The object's repr, asserted to be one line that a terminal holds."""
    line = repr(shown)
    assert "\n" not in line
    assert len(line) <= WIDTH
    assert line.startswith(f"<{type(shown).__name__}: ")
    return line


def text_of(shown: object, label: str = "") -> str:
    """The text of the object's HTML, asserted to be a table and nothing else, with the label."""
    html = shown._repr_html_()  # type: ignore[attr-defined]
    parsed = _Tags()
    parsed.feed(html)
    assert parsed.tags <= OURS
    assert label in parsed.text
    return parsed.text

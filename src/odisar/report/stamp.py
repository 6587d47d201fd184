"""What a page of the report says of the content that it was made from."""

from pathlib import Path

#: Names the content that a page was made from, so that a stale page can be told.
CONTENT_META = "odisar-content"


def page_content(path: Path) -> str | None:
    """Return the content that a page on disk was made from, or None."""
    if not path.is_file():
        return None
    head = path.read_text(encoding="utf-8")[:2000]
    _, found, rest = head.partition(f'<meta name="{CONTENT_META}" content="')
    return rest.partition('"')[0] if found else None

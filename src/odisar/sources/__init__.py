"""Public recordings: fetch a pinned file, convert it to a folder that the reader takes."""

"""Windows: scaled samples, and views into them that never cross a recording or a gap."""

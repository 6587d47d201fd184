"""What a user would try instead: detectors that need no capability."""

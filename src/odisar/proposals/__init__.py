"""Propose a case for a stranger's recordings, and say what is wrong with them.

Nothing here is used by the pipeline: a proposal is text for ``params.yaml`` that its user reads,
corrects and keeps. What was guessed says so.
"""

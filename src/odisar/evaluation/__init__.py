"""Evaluation: scored recordings in, tidy tables with intervals out.

``scored`` is the input contract, ``protocols`` turns it into labelled samples, ``metrics`` and
``alarms`` measure, ``intervals`` says how sure that is, and ``tables`` puts it all into rows.
"""

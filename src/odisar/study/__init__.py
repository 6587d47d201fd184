"""The full study: every alternative, several training seeds, forecasts, confidence, development.

Its parts stand on what the pipeline has made (``build/``), are resumable one by one
(``study/dvc.yaml``), and write what they find to ``reports/study``.
"""

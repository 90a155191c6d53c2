"""The Benchmark for Surface Region Correspondence (BSRC): the paper's Table II.

In come BSRC's folder and methods that find regions; out go every metric of every pair, as tables,
CSV and JSON, and a picture.
"""

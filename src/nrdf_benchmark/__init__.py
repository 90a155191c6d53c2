"""Evidence for NRDF: benchmarks, rivals (NDF, IMDC) and ablations.

In come trained models and benchmark folders (BSRC, labelled meshes); out go tables, CSV, JSON and
pictures. It is run as `nrdf eval ...` and `nrdf ablate`; the package `nrdf` never imports it.
"""

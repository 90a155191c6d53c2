"""Readers, one module for each file format.

In comes a path, out comes a `RawCloud`: what the file holds, its sizes checked, its values not yet.
"""

"""Networks of rival methods, NDF and IMDC, that the benchmark trains and runs like NRDF's own.

They are entry points of the group `nrdf.presets`: `nrdf model train --preset ndf` finds them by
name.
"""

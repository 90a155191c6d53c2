"""Tool paths as files for robots, machine tools and CAM.

In: a job. Out: programs and data, one module for each format (`registry.FORMATS`).
"""

"""Tool paths as files for robots, machine tools and CAM: a registry, and one writer a file."""

"""Objects, files and small models that several tests build."""

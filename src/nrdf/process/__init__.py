"""Process knowledge: its file, tool paths on surfaces, transfer to other objects, the report."""

"""Scans as they come: simulated, cleaned, aligned with their category's frame."""

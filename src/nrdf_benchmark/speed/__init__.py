"""How fast and how large: retrieval by phase, whole transfers, training steps.

In come presets and a device; out go seconds and bytes.
"""

"""Pictures of clouds with their regions and tool paths, drawn without OpenGL.

In come points, regions and lines; out come arrays of pixels, or a picture file. `palette` has all
colours.
"""

"""The object library: procedural training objects, YCB scans, and the user's own meshes from a folder."""

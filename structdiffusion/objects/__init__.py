"""The object library: procedural training objects, YCB scans, and a folder of the user's own meshes."""

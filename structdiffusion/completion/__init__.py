"""Complete partly seen objects: estimate the whole body from the points that the camera saw."""

"""Find a table and the objects on it in the measurements of a depth camera."""

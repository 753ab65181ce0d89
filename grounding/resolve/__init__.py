"""Find the objects that the words of a goal mean: in a scene, in a library, or nowhere yet."""

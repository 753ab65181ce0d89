"""Find the objects that a single noun phrase means, where the phrase was copied out of an instruction."""

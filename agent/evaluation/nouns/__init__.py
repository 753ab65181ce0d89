"""Judge the nouns that are given to objects in recordings, and learn what tells their shapes apart."""

"""Read goals with a language model: one behind an address, or a small one on this machine."""

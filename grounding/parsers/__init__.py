"""Parse instructions to slots by sentence embeddings or by a language model."""

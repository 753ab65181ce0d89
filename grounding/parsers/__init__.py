"""Parsers: instruction to slots, by sentence embeddings or by a language model."""

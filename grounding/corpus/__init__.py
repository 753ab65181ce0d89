"""Generate labelled training sentences: a grammar, free templates, paraphrases and typing errors."""

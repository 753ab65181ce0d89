"""Read goals of several parts with a trained network that copies the words for objects and lengths."""

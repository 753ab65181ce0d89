"""The geometry of figures: strokes sampled at a number of places, blocks that carry each other, figures of examples."""

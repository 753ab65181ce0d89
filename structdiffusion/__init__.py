"""(Specification or sentence, object point clouds) to ranked goal poses."""

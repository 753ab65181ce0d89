"""Turn a specification or sentence and the point clouds of objects into ranked goal poses."""

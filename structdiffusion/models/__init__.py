"""The networks, one folder each: `config.json` and `model.safetensors` make a checkpoint."""


def structformer_name(shape: str) -> str:
    """Return the name of the autoregressive network for a shape; each shape has its own network."""
    return f"structformer_{shape.replace(' ', '_')}"

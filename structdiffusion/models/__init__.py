"""The networks, one folder each: `config.json` and `model.safetensors` make a checkpoint."""


def structformer_name(shape: str) -> str:
    """What the autoregressive network for a shape is called; there is one for each."""
    return f"structformer_{shape.replace(' ', '_')}"

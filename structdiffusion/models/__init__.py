"""The networks, one folder each: `config.json` and `model.safetensors` make a checkpoint."""

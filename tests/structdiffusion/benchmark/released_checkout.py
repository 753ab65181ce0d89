"""A small package with the import paths and signatures of the released network, which stands in for it."""

from pathlib import Path

MODEL = """
import torch
class TransformerDiffusionModel(torch.nn.Module):
    def __init__(self, vocab_size, encoder_input_dim=256, encoder_hidden_dim=16, encoder_dropout=0.1,
                 ignore_rgb=False, max_seq_size=7):
        super().__init__()
        assert (encoder_hidden_dim, encoder_dropout, ignore_rgb) == (512, 0.0, True)
        self.words = torch.nn.Embedding(vocab_size, 9)
        self.places = torch.nn.Embedding(max_seq_size, 9)
        self.kinds = torch.nn.Embedding(4, 9)
        self.asked = []
    def forward(self, t, pcs, sentence, poses, type_index, position_index, pad_mask):
        assert pcs.shape[2:] == (1024, 3) and poses.shape == (len(pcs), 1 + pcs.shape[1], 9)
        assert sentence.shape == (len(pcs), 5) and not pad_mask.any() and not self.training
        assert type_index.shape == position_index.shape == pad_mask.shape == (len(pcs), 6 + pcs.shape[1])
        self.asked.append(int(t[0]))
        tokens = self.places(position_index) + self.kinds(type_index)
        return poses * 0.5 + 0.0 * tokens[:, 5:] + 0.0 * self.words(sentence).mean(1, keepdim=True)
"""
SCHEDULE = """
import torch
class NoiseSchedule:
    def __init__(self, timesteps=200):
        self.timesteps = timesteps
        self.betas = torch.full((timesteps,), 0.01)
        self.sqrt_recip_alphas = torch.full((timesteps,), 2.0)
        self.sqrt_one_minus_alphas_cumprod = torch.full((timesteps,), 0.1)
        self.posterior_variance = torch.full((timesteps,), 0.25)
"""


def checkout(folder: Path, model: str = MODEL) -> Path:
    """Write a checkout to a folder, and return the folder."""
    for path, text in (("models/models.py", model), ("diffusion/noise_schedule.py", SCHEDULE)):
        (file := folder / "src" / "StructDiffusion" / path).parent.mkdir(parents=True)
        file.write_text(text)
    return folder

"""What is done with proposals: settled, refined, ranked, tried out in physics."""

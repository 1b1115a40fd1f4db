"""What a recording says about friction: rows of numbers with noise, each of which a model predicts."""

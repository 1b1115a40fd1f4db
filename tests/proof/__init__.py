"""The proof by others: worlds that the tool was not made on, each in a folder of its own."""
